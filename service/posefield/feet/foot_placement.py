"""Frames of motions with the feet placed where the plans say.

Motions with the same limbs are placed at once; each has the same bytes as if it were alone.
"""

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass
from typing import Annotated, TypeVar

import numpy as np

from posefield.common import frame_groups
from posefield.common.frame_groups import FrameGroups, FrameRows
from posefield.common.units import UP, Floats, Frames, Indices, RootPath, Rotations
from posefield.feet import limbs, two_bone
from posefield.feet.footsteps import FeetPlan
from posefield.feet.limbs import Limb, LimbPoses
from posefield.feet.stances import Cycle
from posefield.locomotion import floor_plane
from posefield.motion import quat, skeleton
from posefield.question.floor import Floors

Own = TypeVar("Own")
Found = TypeVar("Found")
Path = Annotated[Floats, "frames 3"]


@dataclass(frozen=True)
class PlacementRequest:
    """Predicted poses of a motion at times (S,), s, whose feet are placed by its plan.

    rotations: (S, J, 4). roots: (S, 3), m. joints: those whose positions are needed; limbs without
    any of them are not turned. None for all.
    """

    plan: FeetPlan
    times: Frames
    rotations: Rotations
    roots: RootPath
    joints: Collection[int] | None = None


@dataclass(frozen=True)
class PlacedFrames:
    """Frames whose feet are placed: rotations (S, J, 4) and roots (S, 3), m."""

    rotations: Rotations
    roots: RootPath


@dataclass(frozen=True)
class FootPaths:
    """Paths of K feet (F, K, 3), m, over the grid of a plan: predicted and placed."""

    before: Annotated[Floats, "frames feet 3"]
    after: Annotated[Floats, "frames feet 3"]


def place_motions(requests: Sequence[PlacementRequest]) -> list[PlacedFrames]:
    """Return the frames of motions with the feet where their plans say."""
    kinds = [(*_kind(own.plan), own.joints and tuple(own.joints)) for own in requests]
    return _by_kind(requests, kinds, _place_alike)


def place_feet(
    plan: FeetPlan,
    times: Frames,
    rotations: Rotations,
    roots: RootPath,
    joints: Collection[int] | None = None,
) -> PlacedFrames:
    """Return the frames of one motion with placed feet; arguments as of `PlacementRequest`."""
    return place_motions([PlacementRequest(plan, times, rotations, roots, joints)])[0]


def foot_paths(plans: Sequence[FeetPlan]) -> list[FootPaths]:
    """Return the paths of the planted feet over the grid of each plan."""
    return _by_kind(plans, [_kind(own) for own in plans], _paths_alike)


def largest_drifts(
    plans: Sequence[FeetPlan], after: Sequence[Annotated[Floats, "_ feet 3"]]
) -> list[float]:
    """Return the largest distances over the floor of standing feet from their places, m.

    after: paths (F, K, 3), m, of the placed feet of each plan.
    """
    drifts = []
    for plan, paths in zip(plans, after, strict=True):
        away = [
            paths[stance.begin : stance.end, foot] - anchor
            for foot, steps in enumerate(plan.steps)
            for stance, anchor in zip(steps.stances, steps.anchors, strict=True)
        ]
        # Frames over the end of a cycle are those of its start, which have places of their own.
        every = np.concatenate([np.zeros((1, 3)), *away])
        drifts.append(float(np.hypot(every[:, 0], every[:, 2]).max()))
    return drifts


def _kind(plan: FeetPlan) -> tuple[object, ...]:
    """Return what motions that are placed at once have in common."""
    return plan.character.parents, plan.character.legs, plan.character.kept


def _by_kind(
    every: Sequence[Own],
    kinds: Sequence[object],
    make: Callable[[Sequence[Own]], list[Found]],
) -> list[Found]:
    """Return what is made of each, of those of one kind at once."""
    found: dict[int, Found] = {}
    for kind in dict.fromkeys(kinds):
        places = [place for place, own in enumerate(kinds) if own == kind]
        found |= zip(places, make([every[place] for place in places]), strict=True)
    return [found[place] for place in range(len(every))]


def _place_alike(requests: Sequence[PlacementRequest]) -> list[PlacedFrames]:
    plans, body = [own.plan for own in requests], requests[0].plan.character
    groups = frame_groups.of_lengths([own.times for own in requests])
    turned, roots = (
        np.concatenate([getattr(own, name) for own in requests]) for name in ("rotations", "roots")
    )
    bones = np.stack([plan.character.bones for plan in plans])
    poses = limbs.evaluate_motions(body.parents, bones, body.limbs, turned, roots, groups)
    placing = _Placing.at(
        plans, poses, np.concatenate([own.times * own.plan.rate for own in requests])
    )
    joints = requests[0].joints
    above = (
        None
        if joints is None
        else {upper for joint in joints for upper in skeleton.joint_chain(body.parents, joint)[:-1]}
    )
    for index, (limb, target) in enumerate(placing.targets()):
        if above is not None and limb.upper not in above:
            continue
        found = two_bone.solve(poses, limb, two_bone.reach(poses, limb, placing.shift, target))
        found.apply(limb, turned)
        if index < len(body.legs):
            turned[:, limb.lower] = placing.tilted(limb, found.lower)
    parts = zip(groups.split(turned), groups.split(roots + placing.shift), strict=True)
    return [PlacedFrames(*own) for own in parts]


def _paths_alike(plans: Sequence[FeetPlan]) -> list[FootPaths]:
    """Return the paths of the planted feet of motions with the same limbs."""
    poses, legs = limbs.join([plan.poses for plan in plans]), plans[0].character.legs
    groups = frame_groups.of_lengths([plan.lowered for plan in plans])
    placing = _Placing.at(plans, poses, groups.frame.astype(float))
    before, after = np.empty((2, len(placing.at_frames), len(legs), 3))
    for foot, (leg, target) in enumerate(list(placing.targets())[: len(legs)]):
        upper = poses.position(leg.upper) + placing.shift
        before[:, foot] = poses.position(leg.tip)
        end = two_bone.reach(poses, leg, placing.shift, target)
        after[:, foot] = upper + end + placing.arm(leg)
    return [FootPaths(*own) for own in zip(groups.split(before), groups.split(after), strict=True)]


@dataclass(frozen=True)
class _Placing:
    """Poses of motions with the same limbs, and where their plans are evaluated.

    poses: of the limbs, at N frames. at_frames: fractional frames (N,) of the grids of the plans.
    grids: of the plans. ways, factors: (M,), of their cycles. shift: of the roots (N, 3), m.
    """

    plans: Sequence[FeetPlan]
    poses: LimbPoses
    at_frames: Frames
    grids: FrameRows
    ways: Annotated[floor_plane.FloorVectors, "motions"]
    factors: Annotated[floor_plane.FloorVectors, "motions"]
    floors: Floors
    shift: Path

    @classmethod
    def at(cls, plans: Sequence[FeetPlan], poses: LimbPoses, at_frames: Frames) -> "_Placing":
        """Return the placing at fractional frames (N,) of the grids."""
        assert poses.groups is not None
        grids = FrameRows(
            frame_groups.of_lengths([plan.lowered for plan in plans]),
            np.array([plan.rate for plan in plans]),
            np.array([plan.cycle is not None for plan in plans]),
        )
        cycles = [plan.cycle or Cycle(0.0, 0.0) for plan in plans]
        ways, factors = (
            np.array([getattr(own, name) for own in cycles], complex) for name in ("way", "factor")
        )
        floors = Floors([plan.floor for plan in plans], poses.groups)
        lowered = np.concatenate([plan.lowered for plan in plans])
        down = _interpolate(grids, lowered, poses.groups, at_frames)
        shift = -down[:, None] * UP
        return cls(plans, poses, at_frames, grids, ways, factors, floors, shift)

    @property
    def groups(self) -> FrameGroups:
        """Return the groups of the poses."""
        return self.floors.groups

    def targets(self) -> Iterator[tuple[Limb, Path]]:
        """Yield each limb with the target (N, 3), m, of its end, the legs first."""
        body = self.plans[0].character
        for foot, leg in enumerate(body.legs):
            change = np.concatenate([plan.changes[foot] for plan in self.plans])
            path = self.poses.position(leg.tip) + self._moved(change)
            yield leg, self._anchored(foot, path) - self.arm(leg)
        for index, limb in enumerate(body.kept):
            # Where it is not led, the end moves with the root.
            share = np.concatenate([plan.led.limbs[index] for plan in self.plans])
            led = _interpolate(self.grids, share, self.groups, self.at_frames)
            free = 1.0 - np.clip(led, 0.0, 1.0)
            yield limb, self.poses.position(limb.lower) + free[:, None] * self.shift

    def arm(self, leg: Limb) -> Path:
        """Return the vectors (N, 3), m, from the ankle to the joint that stands."""
        return self.floors.tilted(self.poses.position(leg.tip) - self.poses.position(leg.lower))

    def tilted(
        self, limb: Limb, turns: Annotated[Floats, "frames 4"]
    ) -> Annotated[Floats, "frames 4"]:
        """Return rotations (N, 4) of feet, tilted as the floor is, in the axes of the ankle."""
        sloped = self.floors.sloped
        if not sloped.any():
            return turns
        own, found = self.poses.orientation(limb.lower)[sloped], turns.copy()
        tilt = quat.mul(quat.conj(own), quat.mul(self.floors.tilts[sloped], own))
        found[sloped] = quat.mul(turns[sloped], tilt)
        return found

    def _moved(self, change: Annotated[Floats, "grid 3"]) -> Path:
        """Return the changes (N, 3), m, of paths with changes on the grids."""
        turned = floor_plane.project(change)
        over = _interpolate(self.grids, turned, self.groups, self.at_frames, self.factors)
        up = _interpolate(self.grids, change @ UP, self.groups, self.at_frames)
        return floor_plane.at_height(over, up)

    def _anchored(self, foot: int, path: Path) -> Path:
        """Return the paths (N, 3), m, exactly at their anchors in each stance."""
        held = _stances_of(self.plans, foot, self.grids, self.ways, self.factors)
        found, groups = path.copy(), self.groups
        # Memory and time grow with the frames and the stances, not with their product.
        for motion, at in enumerate(groups.split(self.at_frames)):
            own = np.flatnonzero(held.motions == motion)
            order = np.argsort(at, kind="stable")
            begin = np.searchsorted(at, held.first[own] - 1e-9, "left", order)
            counts = np.searchsorted(at, held.last[own] + 1e-9, "right", order) - begin
            each = FrameGroups(counts)
            rows = groups.starts[motion] + order[begin[each.group] + each.frame]
            found[rows] = held.anchors[own[each.group]]
        return found


@dataclass(frozen=True)
class _Anchored:
    """Stances of one foot in all motions, those of cycles also a cycle earlier and later.

    motions: (S,). first, last: frames (S,). anchors: (S, 3), m.
    """

    motions: Annotated[Indices, "stances"]
    first: Annotated[Indices, "stances"]
    last: Annotated[Indices, "stances"]
    anchors: Annotated[Floats, "stances 3"]


def _stances_of(
    plans: Sequence[FeetPlan],
    foot: int,
    grids: FrameRows,
    ways: Annotated[floor_plane.FloorVectors, "motions"],
    factors: Annotated[floor_plane.FloorVectors, "motions"],
) -> _Anchored:
    """Return the stances of a foot, each copy after its original."""
    found = [
        (motion, own.begin, own.end - 1)
        for motion, plan in enumerate(plans)
        for own in plan.steps[foot].stances
    ]
    motions, first, last = np.array(found, np.int64).reshape(-1, 3).T
    anchors = np.concatenate([plan.steps[foot].anchors for plan in plans])
    cyclic, counts = grids.cyclic[motions], grids.counts[motions]
    floor, heights = floor_plane.project(anchors), anchors @ UP
    ways, factors = ways[motions], factors[motions]
    earlier = floor_plane.at_height(np.conj(factors) * (floor - ways), heights)
    later = floor_plane.at_height(ways + factors * floor, heights)
    over, begun = cyclic & (last >= counts), cyclic & (first == 0)
    before, after = (first - counts)[over], (last + counts)[begun]
    return _Anchored(
        np.concatenate([motions, motions[over], motions[begun]]),
        np.concatenate([first, before, counts[begun]]),
        np.concatenate([last, (last - counts)[over], after]),
        np.concatenate([anchors, earlier[over], later[begun]]),
    )


def _interpolate(
    grids: FrameRows,
    values: Annotated[np.ndarray, "grid"],
    groups: FrameGroups,
    at: Frames,
    factors: Annotated[floor_plane.FloorVectors, "motions"] | None = None,
) -> Annotated[np.ndarray, "frames"]:
    """Return values at fractional frames (N,): cubic Hermite, slopes by central differences.

    values: on the grids. groups: motion of each frame (N,). factors: turns (M,) of the values from
    one cycle to the next.
    """
    if np.array_equal(at, grids.groups.frame):
        # On the grids, where the slopes do not matter.
        return values
    motions = groups.group
    counts, cyclic = grids.counts[motions], grids.cyclic[motions]
    before = np.clip(np.floor(at + 1e-9).astype(np.int64), 0, counts - 1)
    share = np.clip(at - before, 0.0, 1.0)
    around = []
    for offset in (-1, 0, 1, 2):
        frame = before + offset
        own = np.where(cyclic, frame % counts, np.clip(frame, 0, counts - 1))
        value = values[grids.groups.starts[motions] + own]
        if factors is not None:
            turn = np.where(frame < 0, np.conj(factors)[motions], factors[motions])
            value = np.where(cyclic & (frame != own), turn * value, value)
        around.append(value)
    a, b, c, d = around
    found: Floats = b + 0.5 * share * (
        c - a + share * (2.0 * a - 5.0 * b + 4.0 * c - d + share * (3.0 * (b - c) + d - a))
    )
    return found
