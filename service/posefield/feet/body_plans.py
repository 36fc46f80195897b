"""Plans of the feet of motions whose characters have the same limbs, all at once.

Frames of all motions lie one after another, and so do those of all feet, foot after foot. Nothing
of a motion depends on the others: sums are over its own frames, and products are element by
element.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from posefield.common import cancellation, frame_groups
from posefield.common.frame_groups import FrameRows
from posefield.common.units import UP, Booleans, Floats, Frames
from posefield.feet import ball_path, footsteps, heel_roll, limbs, stance_rows, two_bone
from posefield.feet.footsteps import FeetPlan, Floors, Footsteps, PlanRequest
from posefield.feet.limbs import Limb, LimbPoses
from posefield.feet.stance_rows import SUNK, UNEVEN, FootRows, Interval, Runs
from posefield.locomotion import floor_plane
from posefield.motion import quat
from posefield.motion.contact_detection import FootContact
from posefield.question.motion_question import LEVEL_FLOOR, Floor

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
        character = requests[0].character
        groups = frame_groups.of_lengths([request.roots for request in requests])
        rotations, roots = (
            np.concatenate([getattr(request, name) for request in requests])
            for name in ("rotations", "roots")
        )
        bones = np.stack([request.character.bones for request in requests])
        poses = limbs.evaluate_motions(
            character.parents, bones, character.limbs, rotations, roots, groups
        )
        rows = FrameRows(
            groups,
            np.array([request.rate for request in requests], float),
            np.array([request.cycle is not None for request in requests]),
        )
        fixed, raised = (
            np.array([getattr(request.character, name) for request in requests])
            for name in ("fixed", "raised")
        )
        leads = footsteps.joined([request.leads for request in requests])
        return cls(requests, poses, roots, rows, fixed, raised, leads.room(poses, character.limbs))

    @property
    def legs(self) -> tuple[Limb, ...]:
        """Return the legs of all characters."""
        return self.requests[0].character.legs

    @property
    def floors(self) -> Floors:
        """Return the floors of the motions."""
        return Floors([request.floor for request in self.requests], self.rows.groups)

    def plans(self) -> list[FeetPlan]:
        """Return the plans of all motions."""
        feet, down = self._feet()
        above = stance_rows.heights_above(feet.heights, down, feet.height, feet.rows)
        grounded = self._grounded(above.reshape(len(self.legs), -1))
        # Characters stand as high as their feet do: the ground first.
        lowered = np.tile(grounded, len(self.legs))
        feet = replace(
            feet,
            heights=feet.heights - lowered[feet.rows.groups.group],
            height=feet.height + np.clip(above - lowered, -SUNK, UNEVEN),
            flat_pitch=heel_roll.flat_pitches(feet.arms, down, feet.rows),
        )
        toe_heights = feet.height + self._toe_drops(down, feet.rows)
        stances = heel_roll.trimmed(stance_rows.discipline(down, feet), feet)
        stances = self._led_stances(stances, feet)
        followed = self._follow(grounded)
        reachable, paths, lowered = self._reachable_steps(feet, grounded, followed, stances)
        before = stances.by_row(len(feet.height))
        after = self._footsteps(feet, paths, reachable)
        return list(self._split(paths, before, after, toe_heights, grounded, followed, lowered))

    def _toe_drops(self, contacts: Runs, rows: FrameRows) -> Annotated[Floats, "rows"]:
        """Return how far the ends of toes are above the balls of flat feet (R,), m.

        Minus infinity for legs without toes.
        """
        drops = np.full((len(self.legs), len(self.requests)), -np.inf)
        toes = [np.zeros((0, 3))]
        for leg in self.legs:
            toe = np.broadcast_to(leg.toe or (0.0, 0.0, 0.0), self.roots.shape)
            toes.append(quat.rotate(self.poses.orientation(leg.tip), toe))
        pitches = heel_roll.flat_pitches(np.concatenate(toes), contacts, rows)
        for drop, leg, pitch in zip(drops, self.legs, pitches.reshape(drops.shape), strict=True):
            if leg.toe is not None:
                drop[:] = math.hypot(*leg.toe) * np.sin(pitch)
        return drops.ravel()

    def _footsteps(self, feet: FootRows, paths: FootPaths, stances: Runs) -> list[Footsteps]:
        """Return the footsteps of each row."""
        rolled, first = heel_roll.roll(feet, stances), feet.rows.flat(stances.rows, stances.begins)
        offset = floor_plane.at_height(rolled.floor[first], rolled.heights[first])
        anchors = paths[first] - offset
        return [
            Footsteps(row, anchors[stances.rows == index], rolled.flats[stances.rows == index])
            for index, row in enumerate(stances.by_row(len(feet.height)))
        ]

    def _split(
        self,
        paths: FootPaths,
        before: Sequence[tuple[Interval, ...]],
        after: Sequence[Footsteps],
        toe_heights: Annotated[Floats, "rows"],
        grounded: PerMotion,
        followed: Frames,
        lowered: Frames,
    ) -> Iterator[FeetPlan]:
        """Yield the plan of each motion. before, after: stances of the rows, and steps in reach."""
        groups = self.rows.groups
        by_leg = paths.reshape(len(self.legs), len(lowered), 3)
        changes = np.empty(by_leg.shape)
        for change, path, leg in zip(changes, by_leg, self.legs, strict=True):
            change[:] = path - self.poses.position(leg.tip)
        root_lowered = followed + lowered
        for motion, (request, poses) in enumerate(
            zip(self.requests, self.poses.split(), strict=True)
        ):
            frames = slice(groups.starts[motion], groups.starts[motion] + groups.counts[motion])
            steps = tuple(after[motion :: len(groups)])
            yield FeetPlan(
                request.character,
                request.rate,
                request.cycle,
                steps,
                changes[:, frames],
                root_lowered[frames],
                followed[frames],
                float(grounded[motion]),
                poses,
                request.leads,
                toe_heights[motion :: len(groups)],
                request.floor,
                _unreached(request.floor, before[motion :: len(groups)], steps),
            )

    def _feet(self) -> tuple[FootRows, Runs]:
        """Return the feet as predicted, and their contacts; rows are leg after leg."""
        legs = len(self.legs)
        groups = self.rows.groups.times(legs)
        rows = FrameRows(groups, np.tile(self.rows.rates, legs), np.tile(self.rows.cyclic, legs))
        paths = [self.poses.position(leg.tip) for leg in self.legs]
        points = np.concatenate([np.zeros((0, 3)), *paths])
        ankles = [self.poses.position(leg.lower) for leg in self.legs]
        down, contacts = self._contacts(points, rows)
        height, swing, longest_swing, clearance = (
            np.array([getattr(contact, name) for contact in contacts], float)
            for name in ("height", "swing", "longest_swing", "clearance")
        )
        walking = [
            np.zeros(len(request.roots), bool) if request.walking is None else request.walking
            for request in self.requests
        ]
        ways, factors = stance_rows.cycle_motions([request.cycle for request in self.requests])
        feet = FootRows(
            rows,
            floor_plane.project(points),
            points @ UP,
            height,
            swing,
            longest_swing,
            clearance,
            np.tile(ways, legs),
            np.tile(factors, legs),
            np.tile(np.concatenate(walking), legs),
            points - np.concatenate([np.zeros((0, 3)), *ankles]),
            np.zeros(len(height)),
        )
        return feet, down

    def _contacts(self, points: FootPaths, rows: FrameRows) -> tuple[Runs, list[FootContact]]:
        """Return the contacts of feet (K N, 3), m, and their statistics (K M)."""
        likely = [request.likely for request in self.requests if request.likely is not None]
        if likely:
            contacts = [
                request.contacts[leg] for leg in range(len(self.legs)) for request in self.requests
            ]
            return stance_rows.from_probabilities(np.concatenate(likely).T.ravel(), rows), contacts
        motions = [request for _ in self.legs for request in self.requests]
        paths = rows.groups.split(points)
        down = [
            stance_rows.detect(path, motion.rate, motion.cycle)
            for path, motion in zip(paths, motions, strict=True)
        ]
        contacts = [
            stance_rows.statistics(0, path @ UP, motion.rate, standing, motion.cycle is not None)
            for path, motion, standing in zip(paths, motions, down, strict=True)
        ]
        return stance_rows.runs(np.concatenate([np.zeros(0, bool), *down]), rows), contacts

    def _grounded(self, above: Annotated[Floats, "feet motions"]) -> PerMotion:
        """Return how far characters are lowered to the ground (M,), m: they float, or sink.

        Feet may be uneven, and limbs that keep their ends must reach them.
        """
        if not len(above):
            return np.zeros(len(self.requests))
        mean, (up, down), groups = above.mean(axis=0), self.room, self.rows.groups
        lowered = mean - np.clip(mean, -SUNK, UNEVEN)
        lowered = np.clip(lowered, -groups.smallest(up), groups.smallest(down))
        return np.where(self.fixed, 0.0, lowered)

    def _led_stances(self, stances: Runs, feet: FootRows) -> Runs:
        """Return the stances that agree with where the feet are led."""
        leads = [request.leads.feet for request in self.requests]
        if not any(led.any() for led in leads):
            return stances
        down, groups = stances.mask(feet.rows), feet.rows.groups
        points = groups.split(feet.positions)
        for row, standing in enumerate(groups.split(down)):
            exact = np.flatnonzero(leads[row % len(leads)][row // len(leads)])
            rate, contact = float(feet.rows.rates[row]), feet.contact(row)
            footsteps.lead_stances(standing, points[row], rate, contact, exact)
        led = stance_rows.runs(down, feet.rows)
        return led.select(
            ~led.inner(feet.rows) | (led.lengths >= stance_rows.shortest(feet.rows)[led.rows])
        )

    def _follow(self, grounded: PerMotion) -> Frames:
        """Return how much the roots are lowered so that they follow the floor (N,), m.

        Limbs that keep their ends must reach them; the legs make up for the rest.
        """
        lowered = grounded[self.rows.groups.group] - self.floors.heights(self.roots)
        up, down = self.room
        high = two_bone.cover(np.maximum(-lowered - up, 0.0), self.rows)
        low = two_bone.cover(np.maximum(lowered - down, 0.0), self.rows)
        stays = (self.fixed & ~self.raised)[self.rows.groups.group]
        return np.where(stays, 0.0, lowered + high - low)

    def _reachable_steps(
        self, feet: FootRows, grounded: PerMotion, followed: Frames, stances: Runs
    ) -> tuple[Runs, FootPaths, Frames]:
        """Return the stances, the paths of feet (K N, 3), m, and how far pelvises are lowered, m.

        feet: predicted, on the ground. grounded, followed: how much characters are lowered to the
        level on which they were captured (M,), m, and with how their roots follow the floors (N,),
        m. Stances whose leg does not reach are shortened. Pelvises are lowered (N,) beyond that.
        """
        legs, groups = len(self.legs), self.rows.groups
        slopes = np.array([request.floor.slope for request in self.requests])
        deepest = (two_bone.MOST + STEP * slopes)[groups.group]
        limit = np.clip(self.room[1] - followed, 0.0, deepest)
        limit[self.fixed[groups.group]] = 0.0
        led = footsteps.joined([request.leads for request in self.requests]).feet.ravel()
        goal = np.where(led[:, None], feet.positions, np.nan)
        paths = ball_path.plan_paths(feet, stances, goal)
        needs = self._needs(paths, followed)
        for _ in range(ROUNDS):
            cancellation.check()
            beyond = two_bone.beyond(needs, np.tile(limit, legs))
            shorter = stance_rows.shortened(stances, beyond, feet.rows)
            lost = stances.mask(feet.rows) & ~shorter.mask(feet.rows)
            rows = np.unique(feet.rows.groups.group[lost])
            if not len(rows):
                break
            changed = np.isin(feet.rows.groups.group, rows)
            paths[changed] = ball_path.plan_paths(
                feet.select(rows), shorter.of_rows(rows), goal[changed]
            )
            needs, stances = self._needs(paths, followed), shorter
        lowered = two_bone.lower(list(needs.reshape(legs, len(limit))), limit, self.rows)
        return stances, self._on_floors(paths), lowered

    def _on_floors(self, paths: FootPaths) -> FootPaths:
        """Return paths of feet (K N, 3), m, on floors at height 0 on those of the motions."""
        by_leg = paths.reshape(len(self.legs), len(self.roots), 3)
        heights = [self.floors.heights(path) for path in by_leg]
        return np.asarray(paths + np.concatenate([np.zeros(0), *heights])[:, None] * UP)

    def _needs(self, paths: FootPaths, followed: Frames) -> Annotated[Floats, "foot_frames"]:
        """Return how much lower each leg needs the pelvis to be (K N,), m, with its heel lifted."""
        balls = self._on_floors(paths).reshape(-1, *self.roots.shape)
        needs = [np.zeros(0)]
        for leg, ball in zip(self.legs, balls, strict=True):
            arm = self.floors.tilted(self.poses.position(leg.tip) - self.poses.position(leg.lower))
            hip = self.poses.position(leg.upper) - followed[:, None] * UP
            reach = two_bone.firm_reach(self.poses, leg)
            if leg.tip != leg.lower:
                distance = np.linalg.norm(hip - ball + arm, axis=-1)
                # A micrometre of slack, so that rounding lifts no heel.
                reach = two_bone.leg_chord(self.poses, leg, distance) + 1e-6
                lifted = quat.rotate(heel_roll.heel_turns(hip - ball, arm, reach), arm)
                # On a slope the pelvis sinks first.
                arm = np.where(self.floors.sloped[:, None], arm, lifted)
            needs.append(two_bone.need(self.poses, leg, ball - arm, followed, reach))
        return np.concatenate(needs)


def _unreached(
    floor: Floor, before: Sequence[tuple[Interval, ...]], after: Sequence[Footsteps]
) -> tuple[int, ...]:
    """Return the legs, by index, that stood as predicted, but do not on a given floor."""
    if floor == LEVEL_FLOOR:
        return ()
    pairs = zip(before, after, strict=True)
    return tuple(leg for leg, (first, last) in enumerate(pairs) if first and not last.stances)
