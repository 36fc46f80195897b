"""Frames of motions with the feet placed where the plans say.

Motions with the same limbs are placed at once; each has the same bytes as if it were alone.
"""

from collections.abc import Collection, Iterator, Sequence
from typing import Annotated, NamedTuple

import numpy as np

from posefield.common import cancellation, frame_groups
from posefield.common.frame_groups import FrameGroups, FrameRows
from posefield.common.units import UP, Floats, Frames, RootPath, Rotations
from posefield.feet import ball_path, footsteps, limbs
from posefield.feet.footsteps import FeetPlan, evaluate_by_kind
from posefield.feet.limbs import Limb, LimbPoses, Turns
from posefield.feet.stance_rows import NO_CYCLE
from posefield.locomotion import floor_plane
from posefield.locomotion.floor_plane import FloorVectors
from posefield.motion import quat, skeleton
from posefield.motion.contact_detection import PLANTED_HEIGHT

Points = Annotated[Floats, "frames 3"]
FootPaths = Annotated[Floats, "frames feet 3"]


def place_motions(
    plans: Sequence[FeetPlan],
    times: Sequence[Frames],
    rotations: Sequence[Rotations],
    roots: Sequence[RootPath],
) -> list[tuple[Rotations, RootPath]]:
    """Return rotations (S, J, 4) and roots (S, 3), m, of motions with the feet where plans say.

    times: of each motion (S,), s. rotations, roots: of its predicted poses at these times.
    """
    motions = list(zip(plans, times, rotations, roots, strict=True))
    return evaluate_by_kind(motions, [_kind(plan) for plan in plans], _place_alike)


def place_feet(
    plan: FeetPlan,
    times: Frames,
    rotations: Rotations,
    roots: RootPath,
    joints: Collection[int] | None = None,
) -> tuple[Rotations, RootPath]:
    """Return rotations and roots of one motion, as `place_motions` does.

    joints: those whose positions are needed; limbs without any of them are not turned. None for
    all.
    """
    return _place_alike([(plan, times, rotations, roots)], joints)[0]


def foot_paths(plans: Sequence[FeetPlan]) -> list[tuple[FootPaths, FootPaths]]:
    """Return the paths (F, K, 3), m, of feet over the grid of each plan, predicted and placed."""
    return evaluate_by_kind(plans, [_kind(plan) for plan in plans], _paths_alike)


def place_grids(
    plans: Sequence[FeetPlan], rotations: Annotated[np.ndarray, "frames joints 4"] | None = None
) -> tuple[Points, FootPaths, FootPaths]:
    """Place the feet of motions with the same limbs in all frames of their grids.

    rotations: (N, J, 4), motion after motion; those of the limbs are written there. Returns the
    shifts of the roots (N, 3), m, and the paths of the feet (N, K, 3), m, predicted and placed.
    """
    poses = limbs.join([plan.poses for plan in plans])
    assert poses.groups is not None
    placing = _Placing.at(plans, poses, poses.groups, poses.groups.frame.astype(float))
    before, after = np.empty((2, len(placing.at_frames), len(plans[0].character.legs), 3))
    for foot, limb_end in enumerate(placing.limb_ends()):
        cancellation.check()
        if rotations is not None:
            placing.write_turns(limb_end, rotations)
        if foot < before.shape[1]:
            leg, end, _, arm, _ = limb_end
            before[:, foot] = poses.position(leg.tip)
            after[:, foot] = poses.position(leg.upper) + placing.shift + end + arm
    return placing.shift, before, after


def largest_drifts(
    plans: Sequence[FeetPlan], paths: Sequence[Annotated[Floats, "_ feet 3"]]
) -> list[float]:
    """Return the largest distances over the floor of standing feet from their places, m.

    paths: (F, K, 3), m, of the placed feet of each plan.
    """
    drifts = []
    for plan, feet in zip(plans, paths, strict=True):
        offsets = [
            feet[flat : stance.stop, foot] - anchor
            for foot, steps in enumerate(plan.steps)
            for stance, anchor, flat in zip(
                steps.stances, steps.anchors, steps.flats.tolist(), strict=True
            )
        ]
        # Frames over the end of a cycle are those of its start, which have places of their own.
        away = np.concatenate([np.zeros((1, 3)), *offsets])
        drifts.append(float(np.hypot(away[:, 0], away[:, 2]).max()))
    return drifts


def mean_skate_speeds(
    feet: Sequence[Annotated[Floats, "_ _ 3"]], rates: Sequence[float]
) -> list[float]:
    """Return the mean speeds over the floor of planted feet (F, K, 3) of several motions, m/s.

    Each has the bytes that it has alone. Motions with equally many feet are measured at once.
    """
    means: dict[int, float] = {}
    counts = [paths.shape[1] for paths in feet]
    for count in dict.fromkeys(counts):
        clips = [clip for clip, joints in enumerate(counts) if joints == count]
        groups = frame_groups.of_lengths([feet[clip] for clip in clips])
        paths = np.concatenate([feet[clip] for clip in clips])
        heights = paths @ UP
        lowest = np.minimum.reduceat(heights, groups.starts, axis=0)[groups.group]
        down = heights < lowest + PLANTED_HEIGHT
        planted = np.zeros(down.shape, bool)
        planted[:-1] = down[1:] & down[:-1]
        # The step from the last frame of a motion to the first of the next is none.
        planted[groups.starts + groups.counts - 1] = False
        steps = np.diff(paths, axis=0, append=paths[-1:])
        rate = np.array([rates[clip] for clip in clips])[groups.group, None]
        speeds = rate * np.hypot(steps[..., 0], steps[..., 2])
        frames = groups.sums(planted.astype(float)).sum(axis=1)
        sums = groups.sums(speeds * planted).sum(axis=1) / np.maximum(frames, 1.0)
        means |= zip(clips, sums.tolist(), strict=True)
    return [means[clip] for clip in range(len(feet))]


def _kind(plan: FeetPlan) -> tuple[object, ...]:
    """Return what motions that are placed at once have in common."""
    return plan.character.parents, plan.character.legs, plan.character.kept


def _place_alike(
    motions: Sequence[tuple[FeetPlan, Frames, Rotations, RootPath]],
    joints: Collection[int] | None = None,
) -> list[tuple[Rotations, RootPath]]:
    plans, times, *poses_of_motions = zip(*motions, strict=True)
    body = plans[0].character
    groups = frame_groups.of_lengths(times)
    rotations, roots = (np.concatenate(arrays) for arrays in poses_of_motions)
    bones = np.stack([plan.character.bones for plan in plans])
    poses = limbs.evaluate_motions(
        body.parents, bones, body.legs + body.kept, [rotations], roots, groups
    )
    at_frames = np.concatenate([at * plan.rate for plan, at in zip(plans, times, strict=True)])
    placing = _Placing.at(plans, poses, groups, at_frames)
    above = {
        upper for joint in joints or () for upper in skeleton.joint_chain(body.parents, joint)[:-1]
    }
    for limb_end in placing.limb_ends():
        if joints is None or limb_end[0].upper in above:
            placing.write_turns(limb_end, rotations)
    return list(zip(groups.split(rotations), groups.split(roots + placing.shift), strict=True))


def _paths_alike(plans: Sequence[FeetPlan]) -> list[tuple[FootPaths, FootPaths]]:
    _, before, after = place_grids(plans)
    groups = frame_groups.of_lengths([plan.lowered for plan in plans])
    return list(zip(groups.split(before), groups.split(after), strict=True))


_LimbEnd = tuple[Limb, Points, Turns | None, Points, Annotated[Floats, "frames"] | None]
"""A limb in N frames, and its placed end.

Vectors from its upper joint to the end (N, 3), m; turns of the foot (N, 4) against the poses, or
None; the arm from the end to the joint that stands (N, 3), m, of a turned foot; and the least
height of the end of the toes above that joint (N,), m, None without toes.
"""


class _Placing(NamedTuple):
    """Poses of motions with the same limbs, and where their plans are evaluated.

    poses: of the limbs, at N frames of the groups. at_frames: fractional frames (N,) of the grids
    of the plans. planes, tilts: of the floors of the frames, as of `footsteps.floor_planes`. shift:
    of the roots (N, 3), m.
    """

    plans: Sequence[FeetPlan]
    poses: LimbPoses
    groups: FrameGroups
    at_frames: Frames
    grids: FrameRows
    planes: Annotated[Floats, "frames 3"]
    tilts: Turns | None
    shift: Points

    @classmethod
    def at(
        cls, plans: Sequence[FeetPlan], poses: LimbPoses, groups: FrameGroups, at_frames: Frames
    ) -> "_Placing":
        """Return the placing at fractional frames (N,) of the grids."""
        grids = FrameRows(
            frame_groups.of_lengths([plan.lowered for plan in plans]),
            np.array([plan.rate for plan in plans]),
            np.array([plan.cycle is not None for plan in plans]),
        )
        floors = footsteps.floor_planes([plan.floor for plan in plans], groups)
        lowered = np.concatenate([plan.lowered for plan in plans])
        down = _interpolate(grids, lowered, groups, at_frames)
        return cls(plans, poses, groups, at_frames, grids, *floors, -down[:, None] * UP)

    def limb_ends(self) -> Iterator[_LimbEnd]:
        """Yield the end of each limb, the legs first.

        A foot is tilted as the floor is, and lifts its heel where the leg would be stretched.
        """
        body, poses, groups, tilts = self.plans[0].character, self.poses, self.groups, self.tilts
        ways, factors = np.array([plan.cycle or NO_CYCLE for plan in self.plans], complex).T
        sloped = self.planes[:, 1:].any(axis=1)
        for index, leg in enumerate(body.legs):
            change = np.concatenate([plan.changes[index] for plan in self.plans])
            turned = floor_plane.project(change)
            over = _interpolate(self.grids, turned, groups, self.at_frames, factors)
            up = _interpolate(self.grids, change @ UP, groups, self.at_frames)
            path = poses.position(leg.tip) + floor_plane.at_height(over, up)
            ball = self._anchored(index, path, ways, factors)
            arm, foot = poses.position(leg.tip) - poses.position(leg.lower), tilts
            if tilts is not None:
                arm = footsteps.tilted(self.planes, tilts, arm)
            offset = poses.position(leg.upper) + self.shift - ball
            chord = limbs.leg_chord(poses, leg, np.linalg.norm(offset + arm, axis=-1))
            if leg.tip != leg.lower:
                foot = ball_path.heel_turns(offset, arm, chord)
                arm = quat.rotate(foot, arm)
                if tilts is not None:
                    # A level motion has the same bytes beside a sloped one.
                    foot[sloped] = quat.mul(foot[sloped], tilts[sloped])
            end = -(offset + arm)
            end *= (chord / np.maximum(np.linalg.norm(end, axis=-1), 1e-9))[:, None]
            lowest = None
            if leg.toe is not None:
                toes = np.array([plan.toe_heights[index] for plan in self.plans])[groups.group]
                lowest = toes + footsteps.floor_heights(self.planes, ball) - ball @ UP
            yield leg, end, foot, arm, lowest
        for index, limb in enumerate(body.kept):
            # Where it is not led, the end moves with the root.
            share = np.concatenate([plan.led.limbs[index] for plan in self.plans])
            led = _interpolate(self.grids, share, groups, self.at_frames)
            free = 1.0 - np.clip(led, 0.0, 1.0)
            target = poses.position(limb.lower) + free[:, None] * self.shift
            end = limbs.reach(poses, limb, self.shift, target)
            yield limb, end, None, np.zeros_like(end), None

    def write_turns(
        self, limb_end: _LimbEnd, rotations: Annotated[np.ndarray, "frames joints 4"]
    ) -> None:
        """Write the rotations of a limb's joints, and of bent toes, into poses (N, J, 4)."""
        limb, end, foot, _, lowest_toe = limb_end
        upper, middle, lower = limbs.solve(self.poses, limb, end)
        if foot is not None:
            orientations = self.poses.orientation(limb.lower)
            local = quat.mul(quat.conj(orientations), quat.mul(foot, orientations))
            changed = self.planes[:, 1:].any(axis=1) | (limb.tip != limb.lower)
            lower[changed] = quat.mul(lower, local)[changed]
            if limb.toe is not None and lowest_toe is not None:
                tip = quat.mul(foot, self.poses.orientation(limb.tip))
                toe = quat.rotate(tip, np.broadcast_to(limb.toe, end.shape))
                bent = quat.mul(ball_path.toe_bends(toe, lowest_toe), tip)
                ankle = quat.mul(foot, orientations)
                rotations[:, limb.tip] = quat.normalize(quat.mul(quat.conj(ankle), bent))
        # Poses in single precision are no exact rotations, and errors of a chain add up.
        turns = np.stack([upper, middle, lower], axis=1)
        rotations[:, [limb.upper, limb.middle, limb.lower]] = quat.normalize(turns)

    def _anchored(
        self,
        foot: int,
        path: Points,
        ways: Annotated[FloorVectors, "motions"],
        factors: Annotated[FloorVectors, "motions"],
    ) -> Points:
        """Return the paths (N, 3), m, over the floor exactly at their anchors on flat feet.

        ways, factors: (M,), of the cycles of motions, whose stances are there a cycle earlier and
        later, too, each copy after its original.
        """
        intervals = [
            (motion, flat, stance.stop - 1)
            for motion, plan in enumerate(self.plans)
            for stance, flat in zip(
                plan.steps[foot].stances, plan.steps[foot].flats.tolist(), strict=True
            )
        ]
        motions, first, last = np.array(intervals, np.int64).reshape(-1, 3).T
        anchors = np.concatenate([plan.steps[foot].anchors for plan in self.plans])
        cyclic, counts = self.grids.cyclic[motions], self.grids.groups.counts[motions]
        floor, heights = floor_plane.project(anchors), anchors @ UP
        displacement, factor = ways[motions], factors[motions]
        earlier = floor_plane.at_height(np.conj(factor) * (floor - displacement), heights)
        later = floor_plane.at_height(displacement + factor * floor, heights)
        over, from_start = cyclic & (last >= counts), cyclic & (first == 0)
        motions = np.concatenate([motions, motions[over], motions[from_start]])
        anchors = np.concatenate([anchors, earlier[over], later[from_start]])
        first, last = (
            np.concatenate([first, (first - counts)[over], counts[from_start]]),
            np.concatenate([last, (last - counts)[over], (last + counts)[from_start]]),
        )
        anchored, groups = path.copy(), self.groups
        # Memory and time grow with the frames and the stances, not with their product.
        for motion, at in enumerate(groups.split(self.at_frames)):
            stances = np.flatnonzero(motions == motion)
            order = np.argsort(at, kind="stable")
            begin = np.searchsorted(at, first[stances] - 1e-9, "left", order)
            counts = np.searchsorted(at, last[stances] + 1e-9, "right", order) - begin
            # A stance that ends before its foot is flat has no frames.
            standing = FrameGroups(np.maximum(counts, 0))
            rows = groups.starts[motion] + order[begin[standing.group] + standing.frame]
            anchored[rows, ::2] = anchors[stances[standing.group], ::2]
        return anchored


def _interpolate(
    grids: FrameRows,
    values: Annotated[np.ndarray, "grid"],
    groups: FrameGroups,
    at: Frames,
    factors: Annotated[FloorVectors, "motions"] | None = None,
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
        within = np.where(cyclic, frame % counts, np.clip(frame, 0, counts - 1))
        value = values[grids.groups.starts[motions] + within]
        if factors is not None:
            turn = np.where(frame < 0, np.conj(factors)[motions], factors[motions])
            value = np.where(cyclic & (frame != within), turn * value, value)
        around.append(value)
    a, b, c, d = around
    return np.asarray(
        b
        + 0.5
        * share
        * (c - a + share * (2.0 * a - 5.0 * b + 4.0 * c - d + share * (3.0 * (b - c) + d - a)))
    )
