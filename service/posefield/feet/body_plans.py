"""Plans of the feet of motions whose characters have the same limbs, all at once.

Frames of all motions lie one after another, and so do those of all feet, foot after foot. Nothing
of a motion depends on the others: sums are over its own frames, and products are element by
element.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from posefield.common import cancellation, frame_groups
from posefield.common.frame_groups import FrameRows
from posefield.common.units import UP, Booleans, Floats, Frames
from posefield.feet import ball_path, footsteps, limbs, stance_rows, two_bone
from posefield.feet.ball_path import Footsteps
from posefield.feet.footsteps import Character, FeetPlan, Led, PlanRequest, SampledMotion
from posefield.feet.limbs import Limb, LimbPoses
from posefield.feet.stance_rows import FootRows, Runs
from posefield.feet.stances import UNEVEN, Cycle, FootPath, Interval
from posefield.locomotion import floor_plane
from posefield.motion.contact_detection import FootContact
from posefield.question.floor import LEVEL_FLOOR, Floor, Floors

# Rounds in which stances are shortened whose leg does not reach.
ROUNDS = 4
# On a slope the feet of a step differ in height: the pelvis is lowered by this length times the
# slope more, m.
STEP = 0.4

PerMotion = Annotated[Floats, "motions"]
FootPaths = Annotated[Floats, "foot_frames 3"]
"""Points of all feet (K N, 3), foot after foot."""


def plan_motions(requests: Sequence[PlanRequest]) -> list[FeetPlan]:
    """Return where the feet of motions stand, and how low the pelvis must be for that."""
    kinds = [request.kind for request in requests]
    return footsteps.evaluate_by_kind(requests, kinds, lambda alike: _Bodies.of(alike).plans())


def plan_feet(
    character: Character,
    motion: SampledMotion,
    contacts: Sequence[FootContact] = (),
    likely: Annotated[Floats, "frames feet"] | None = None,
    floor: Floor = LEVEL_FLOOR,
    led: Led | None = None,
) -> FeetPlan:
    """Return the plan of the feet of one motion; arguments as of `PlanRequest`."""
    return plan_motions([PlanRequest(character, motion, contacts, likely, floor, led)])[0]


@dataclass(frozen=True)
class _Bodies:
    """Motions (M,) of characters with the same limbs, whose frames (N,) lie one after another.

    poses: of the limbs. rows: grids of the motions. fixed, raised: (M,), as of the characters.
    room: how far the predicted roots may be raised, and lowered (N,), m.
    """

    requests: Sequence[PlanRequest]
    poses: LimbPoses
    roots: Annotated[Floats, "frames 3"]
    rows: FrameRows
    fixed: Annotated[Booleans, "motions"]
    raised: Annotated[Booleans, "motions"]
    room: tuple[Frames, Frames]

    @classmethod
    def of(cls, requests: Sequence[PlanRequest]) -> "_Bodies":
        """Return the bodies of requests of one kind."""
        character, motions = requests[0].character, [own.motion for own in requests]
        groups = frame_groups.of_lengths([own.roots for own in motions])
        rotations, roots = (
            np.concatenate([getattr(own, name) for own in motions])
            for name in ("rotations", "roots")
        )
        bones = np.stack([own.character.bones for own in requests])
        poses = limbs.evaluate_motions(
            character.parents, bones, character.limbs, rotations, roots, groups
        )
        rows = FrameRows(
            groups,
            np.array([own.rate for own in motions], float),
            np.array([own.cycle is not None for own in motions]),
        )
        fixed, raised = (
            np.array([getattr(own.character, name) for own in requests])
            for name in ("fixed", "raised")
        )
        room = footsteps.joined([own.leads for own in requests]).room(poses, character.limbs)
        return cls(requests, poses, roots, rows, fixed, raised, room)

    @property
    def legs(self) -> tuple[Limb, ...]:
        """Return the legs of all characters."""
        return self.requests[0].character.legs

    def plans(self) -> list[FeetPlan]:
        """Return the plans of all motions."""
        feet, down = self._feet()
        above = stance_rows.heights_above(feet.heights, down, feet.height, feet.rows)
        grounded = self._grounded(above.reshape(len(self.legs), -1))
        # Characters stand as high as their feet do: the ground first.
        lowered = np.tile(grounded, len(self.legs))
        height = feet.height + np.clip(above - lowered, -UNEVEN, UNEVEN)
        heights = feet.heights - lowered[feet.rows.groups.group]
        feet = replace(feet, heights=heights, height=height)
        found = self._led_stances(stance_rows.discipline(down, feet), feet)
        body = _GroundedBodies(self, feet, grounded, self._follow(grounded))
        return body.plans(found)

    def _feet(self) -> tuple[FootRows, Runs]:
        """Return the feet as predicted, and their contacts; rows are leg after leg."""
        legs, motions = len(self.legs), [own.motion for own in self.requests]
        groups = self.rows.groups.times(legs)
        rows = FrameRows(groups, np.tile(self.rows.rates, legs), np.tile(self.rows.cyclic, legs))
        places = [self.poses.position(leg.tip) for leg in self.legs]
        down, known = self._contacts(places, rows)
        height, swing, longest, clearance = (
            np.array([getattr(own, name) for own in known], float)
            for name in ("height", "swing", "longest_swing", "clearance")
        )
        walking = [
            np.zeros(len(own.roots), bool) if own.walking is None else own.walking
            for own in motions
        ]
        cycles = [own.cycle or Cycle(0.0, 0.0) for own in motions]
        ways, factors = (
            np.tile(np.array([getattr(own, name) for own in cycles], complex), legs)
            for name in ("way", "factor")
        )
        whole = np.concatenate([np.zeros((0, 3)), *places])
        feet = FootRows(
            rows,
            floor_plane.project(whole),
            whole @ UP,
            height,
            swing,
            longest,
            clearance,
            ways,
            factors,
            np.tile(np.concatenate(walking), legs),
        )
        return feet, down

    def _contacts(
        self, places: Sequence[Annotated[Floats, "frames 3"]], rows: FrameRows
    ) -> tuple[Runs, list[FootContact]]:
        likely = [own.likely for own in self.requests if own.likely is not None]
        if likely:
            every = np.concatenate(likely).T.ravel()
            known = [own.contacts[leg] for leg in range(len(places)) for own in self.requests]
            return stance_rows.from_probabilities(every, rows), known
        paths = [
            FootPath(path, own.motion.rate, own.motion.cycle, own.motion.walking)
            for leg in places
            for path, own in zip(self.rows.groups.split(leg), self.requests, strict=True)
        ]
        down = stance_rows.from_motion(paths)
        known = [
            stance_rows.statistics(0, path, own) for path, own in zip(paths, down, strict=True)
        ]
        return stance_rows.from_intervals(down), known

    def _grounded(self, above: Annotated[Floats, "feet motions"]) -> PerMotion:
        """Return how far characters are lowered to the ground (M,), m: they float, or sink.

        Feet may be uneven, and limbs that keep their ends must reach them.
        """
        if not len(above):
            return np.zeros(len(self.requests))
        mean = above.mean(axis=0)
        up, down = self.room
        wanted = np.sign(mean) * np.maximum(np.abs(mean) - UNEVEN, 0.0)
        groups = self.rows.groups
        lowered = np.clip(wanted, -groups.smallest(up), groups.smallest(down))
        return np.where(self.fixed, 0.0, lowered)

    def _led_stances(self, found: Runs, feet: FootRows) -> Runs:
        """Return the stances that agree with where the feet are led."""
        led = [own.leads.feet for own in self.requests]
        if not any(own.any() for own in led):
            return found
        paths = feet.paths()
        intervals: list[Sequence[Interval]] = list(found.by_row(len(paths)))
        for row, path in enumerate(paths):
            motion, leg = row % len(led), row // len(led)
            goal = footsteps.goals(path, led[motion][leg])
            intervals[row] = footsteps.lead_stances(intervals[row], path, feet.contact(row), goal)
        return stance_rows.from_intervals(intervals)

    def _follow(self, grounded: PerMotion) -> Frames:
        """Return how much the roots are lowered so that they follow the floor (N,), m.

        Limbs that keep their ends must reach them; the legs make up for the rest.
        """
        wanted = grounded[self.rows.groups.group] - self.floors.heights(self.roots)
        up, down = self.room
        high = two_bone.cover(np.maximum(-wanted - up, 0.0), self.rows)
        low = two_bone.cover(np.maximum(wanted - down, 0.0), self.rows)
        stays = (self.fixed & ~self.raised)[self.rows.groups.group]
        return np.where(stays, 0.0, wanted + high - low)

    @property
    def floors(self) -> Floors:
        """Return the floors of the motions."""
        return Floors([own.floor for own in self.requests], self.rows.groups)


@dataclass(frozen=True)
class _GroundedBodies:
    """Characters on floors.

    feet: predicted, on the ground. grounded: how much they are lowered to the level on which they
    were captured (M,), m. followed: the same, and how their roots follow the floors (N,), m.
    """

    bodies: _Bodies
    feet: FootRows
    grounded: PerMotion
    followed: Frames

    def plans(self, found: Runs) -> list[FeetPlan]:
        """Return the plans of all motions, whose feet stand in the runs if legs reach."""
        legs, groups = len(self.bodies.legs), self.bodies.rows.groups
        kept, paths, lowered = self._reachable_steps(found)
        before, after = found.by_row(legs * len(groups)), kept.by_row(legs * len(groups))
        every = paths.reshape(legs, len(lowered), 3)
        split = [groups.split(own) for own in every]
        predicted = [self.bodies.poses.position(leg.tip) for leg in self.bodies.legs]
        changes = np.array([own - leg for own, leg in zip(every, predicted, strict=True)])
        changes = changes.reshape(every.shape)
        whole, followed = (groups.split(own) for own in (self.followed + lowered, self.followed))
        plans = []
        for motion, (own, poses) in enumerate(
            zip(self.bodies.requests, self.bodies.poses.split(), strict=True)
        ):
            begin = groups.starts[motion]
            stances = after[motion :: len(groups)]
            plans.append(
                FeetPlan(
                    own.character,
                    own.motion.rate,
                    own.motion.cycle,
                    tuple(
                        Footsteps(
                            leg[motion],
                            found,
                            leg[motion][[stance.begin for stance in found]].reshape(-1, 3),
                        )
                        for leg, found in zip(split, stances, strict=True)
                    ),
                    changes[:, begin : begin + groups.counts[motion]],
                    whole[motion],
                    followed[motion],
                    float(self.grounded[motion]),
                    poses,
                    own.leads,
                    own.floor,
                    _unreached(own.floor, before[motion :: len(groups)], stances),
                )
            )
        return plans

    def _reachable_steps(self, found: Runs) -> tuple[Runs, FootPaths, Frames]:
        """Return the stances, the paths of feet (K N, 3), m, and how far pelvises are lowered, m.

        Stances whose leg does not reach are shortened. The last are (N,).
        """
        bodies, feet, legs = self.bodies, self.feet, len(self.bodies.legs)
        slopes = np.array([own.floor.slope for own in bodies.requests])
        deepest = (two_bone.MOST + STEP * slopes)[bodies.rows.groups.group]
        most = np.clip(bodies.room[1] - self.followed, 0.0, deepest)
        most[bodies.fixed[bodies.rows.groups.group]] = 0.0
        goal = self._goal()
        paths = ball_path.plan_paths(feet, found, goal)
        needs = self._needs(paths)
        for _ in range(ROUNDS):
            cancellation.check()
            shorter = stance_rows.shortened(
                found, two_bone.beyond(needs, np.tile(most, legs)), feet.rows
            )
            rows = stance_rows.changed_rows(found, shorter, feet.rows)
            if not len(rows):
                break
            own = np.isin(feet.rows.groups.group, rows)
            paths[own] = ball_path.plan_paths(feet.select(rows), shorter.of_rows(rows), goal[own])
            needs, found = self._needs(paths), shorter
        lowered = two_bone.lower(list(needs.reshape(legs, len(most))), most, bodies.rows)
        return found, self._on_floors(paths), lowered

    def _goal(self) -> FootPaths:
        """Return where feet are led (K N, 3), m, as of `footsteps.goals`."""
        led = footsteps.joined([own.leads for own in self.bodies.requests]).feet.ravel()
        return np.where(led[:, None], self.feet.positions, np.nan)

    def _on_floors(self, paths: FootPaths) -> FootPaths:
        """Return paths of feet (K N, 3), m, on floors at height 0 on those of the motions."""
        legs, floors = len(self.bodies.legs), self.bodies.floors
        every = paths.reshape(legs, len(self.followed), 3)
        heights = [floors.heights(own) for own in every]
        return np.asarray(paths + np.concatenate([np.zeros(0), *heights])[:, None] * UP)

    def _needs(self, paths: FootPaths) -> Annotated[Floats, "foot_frames"]:
        """Return how much lower each leg needs the pelvis to be (K N,), m."""
        poses, bodies = self.bodies.poses, self.bodies
        moved = self._on_floors(paths) - self.feet.positions
        sunk = self.grounded[bodies.rows.groups.group][:, None] * UP
        needs = [np.zeros(0)]
        for leg, change in zip(bodies.legs, moved.reshape(-1, *bodies.roots.shape), strict=True):
            target = poses.position(leg.lower) - sunk + change
            arm = poses.position(leg.tip) - poses.position(leg.lower)
            needs.append(
                two_bone.need(poses, leg, target + (arm - bodies.floors.tilted(arm)), self.followed)
            )
        return np.concatenate(needs)


def _unreached(
    floor: Floor, before: Sequence[tuple[Interval, ...]], after: Sequence[tuple[Interval, ...]]
) -> tuple[int, ...]:
    """Return the legs, by place, that stood as predicted, but do not on a given floor."""
    if floor == LEVEL_FLOOR:
        return ()
    pairs = zip(before, after, strict=True)
    return tuple(leg for leg, (first, last) in enumerate(pairs) if first and not last)
