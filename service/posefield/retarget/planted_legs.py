"""Pelvis and legs of a rig whose feet follow their paths: the pelvis first, then the legs.

A foot of the rig is at the path of the motion's, in proportion to the legs, but for a distance over
the floor that is constant in each stance and changes smoothly in swings. So it slides as the
motion's foot does: not at all where that is exact.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated

import numpy as np

from posefield.common import frame_groups
from posefield.common.units import UP, Booleans, Floats, Frames, Indices, RootPath, Rotations
from posefield.feet import body_plans, limbs, stance_rows
from posefield.feet.limbs import Limb, LimbPoses
from posefield.feet.stance_rows import UNEVEN
from posefield.motion import quat
from posefield.question.results import StanceResult
from posefield.retarget.role_map import SIDES, Body, PosedBody

FADE = 0.1
"""Time over which a correction settles before the first stance and after the last, s."""
HIGHEST_FOOT = 0.2
"""Largest height at rest of a joint that stands, as a share of the leg."""


@dataclass(frozen=True)
class SourceFeet:
    """Feet of a motion, left and right, in proportion to a rig's legs.

    roles: of the joints that contact. paths (F, 2, 3), m. standing (F, 2): whether each stands.
    heights (2,): of the joints while they stand, m.
    """

    roles: tuple[str, str]
    paths: Annotated[Floats, "frames feet 3"]
    stances: tuple[tuple[range, ...], ...]
    heights: Annotated[Floats, "feet"]

    @property
    def standing(self) -> Annotated[Booleans, "frames feet"]:
        """Return whether each foot stands in each frame (F, 2)."""
        standing = np.zeros(self.paths.shape[:2], bool)
        for foot, stances in enumerate(self.stances):
            for stance in stances:
                standing[stance.start : stance.stop, foot] = True
        return standing

    @property
    def floors(self) -> Annotated[Floats, "frames feet"]:
        """Return the height of the floor below each foot (F, 2), m.

        As each stance has it; between two the lower one, so that feet may step up and down.
        """
        floors = np.empty(self.paths.shape[:2])
        for foot, intervals in enumerate(self.stances):
            heights = self.paths[:, foot] @ UP
            level = [float(np.median(heights[s.start : s.stop])) for s in intervals]
            level = level or [float(self.heights[foot])]
            edges = [0, *(s.stop for s in intervals[:-1]), len(heights)]
            begins = [s.start for s in intervals] or [0]
            for index, (first, last) in enumerate(pairwise(edges)):
                floors[first:last, foot] = level[index]
                swing = slice(first, begins[index])
                floors[swing, foot] = min(level[max(index - 1, 0)], level[index])
        return floors - self.heights


def feet_of(
    motion: PosedBody, rig: Body, rate: float, stance_results: Sequence[StanceResult] | None
) -> SourceFeet:
    """Return the feet of a motion in proportion to a rig: toes where both have them, or ankles.

    rate: frames a second. stance_results: stances of the feet; None to detect them.
    """
    source = motion.body
    both = {side + "Toes" for side in SIDES} <= source.joints.keys() & rig.joints.keys()
    left, right = (side + ("Toes" if both else "Foot") for side in SIDES)
    joints = [source.joints[left], source.joints[right]]
    names, paths = [source.names[joint] for joint in joints], motion.positions[:, joints]
    rows = frame_groups.FrameRows(
        frame_groups.of_lengths([paths, paths]), np.full(2, rate), np.zeros(2, bool)
    )
    feet = [paths[:, foot] for foot in range(2)]
    if stance_results is not None:
        runs = stance_rows.from_intervals(
            [_stances(stance_results, name, rate, len(paths)) for name in names]
        )
    else:
        # A single pose has no speeds.
        down = [
            stance_rows.detect(foot, rate) if len(paths) > 1 else np.zeros(1, bool) for foot in feet
        ]
        runs = stance_rows.runs(np.concatenate(down), rows)
    standing = rows.groups.split(runs.mask(rows))
    heights = [
        stance_rows.statistics(index, foot @ UP, rate, down).height
        for index, (foot, down) in enumerate(zip(feet, standing, strict=True))
    ]
    return SourceFeet((left, right), paths, tuple(runs.by_row(2)), np.array(heights))


def _stances(results: Sequence[StanceResult], name: str, rate: float, frames: int) -> list[range]:
    """Return the frames of the stances of a joint."""
    intervals = []
    for stance in results:
        begin, end = round(stance.begin * rate), min(round(stance.end * rate) + 1, frames)
        if stance.joint == name and begin < end:
            intervals.append(range(begin, end))
    return intervals


def standing_heights(feet: SourceFeet, rig: Body) -> Annotated[Floats, "feet"]:
    """Return the heights (2,), m, of the rig's joints while they stand.

    Those above the floor of the file, if it stands on one at rest, and else those of the motion.
    Differences as between the soles of captured performers are left as they are.
    """
    rest = np.array([rig.rest[rig.joints[role]][1] for role in feet.roles])
    is_plausible = 0.0 <= rest.min() and rest.max() <= HIGHEST_FOOT * rig.leg_length
    same = abs(float(np.mean(rest - feet.heights))) <= UNEVEN
    return feet.heights if same or not is_plausible or np.ptp(rest) > UNEVEN else rest


def plan_paths(
    feet: SourceFeet,
    copied: Annotated[Floats, "frames feet 3"],
    heights: Annotated[Floats, "feet"],
    rate: float,
) -> Annotated[Floats, "frames feet 3"]:
    """Return the paths (F, 2, 3), m, of the rig's feet.

    copied: those of copied orientations. heights (2,): while the rig's feet stand, m.
    """
    planned = feet.paths + (heights - feet.heights)[:, None] * UP
    for foot, intervals in enumerate(feet.stances):
        offsets = (copied[:, foot] - feet.paths[:, foot]) * (1.0 - UP)
        planned[:, foot] += offsets + _correction(offsets, intervals, rate)
    return planned


def _correction(offsets: RootPath, intervals: Sequence[range], rate: float) -> RootPath:
    """Return the change (F, 3) of a distance with which it is constant in each stance.

    Between stances it is a cubic with the values and slopes at their ends, before the first and
    after the last it settles at a constant.
    """
    change = np.zeros(offsets.shape)
    if not intervals:
        return change
    slopes = np.gradient(offsets, axis=0) if len(offsets) > 1 else np.zeros(offsets.shape)
    for interval in intervals:
        inside = slice(interval.start, interval.stop)
        change[inside] = offsets[inside].mean(axis=0) - offsets[inside]
    for before, after in pairwise(intervals):
        last, first = before.stop - 1, after.start
        shares = np.arange(1, first - last)[:, None] / (first - last)
        boundary = (change[last], change[first])
        ways = (-(first - last) * slopes[last], -(first - last) * slopes[first])
        change[last + 1 : first] = _cubic(boundary, ways, shares)
    begin, end = intervals[0].start, intervals[-1].stop
    change[:begin] = _settled(change[begin], slopes[begin], np.arange(begin, 0, -1), rate)
    steps = np.arange(1, len(offsets) - end + 1)
    change[end:] = _settled(change[end - 1], -slopes[end - 1], steps, rate)
    return change


def _cubic(
    values: tuple[Floats, Floats], ways: tuple[Floats, Floats], share: Floats
) -> Annotated[Floats, "some 3"]:
    """Return the cubic (S, 3) between two values with slopes, at shares (S, 1)."""
    s = share
    cubic: Floats = (
        (2 * s**3 - 3 * s**2 + 1) * values[0]
        + (s**3 - 2 * s**2 + s) * ways[0]
        + (3 * s**2 - 2 * s**3) * values[1]
        + (s**3 - s**2) * ways[1]
    )
    return cubic


def _settled(
    value: Floats, slope: Floats, steps: Annotated[Indices, "some"], rate: float
) -> Annotated[Floats, "some 3"]:
    """Return values (S, 3) some steps away from one with a slope by step, which fades."""
    fade = FADE * rate
    settled: Floats = value + slope * (fade * -np.expm1(-steps / fade))[:, None]
    return settled


SMOOTHING = 0.12
"""Width, s, of the Gaussian with which the height of the pelvis follows the feet that stand."""
DEEPEST = 0.1
"""Most by which the pelvis is lowered so that the legs reach, as a share of their length."""
FREE_DEPTH, MOST_DEPTH = 0.007, 0.01
"""Depths of soles below the floor that stay as they are, and that none exceeds, m: soles give."""
SAME = 1e-6
"""Distance, m, up to which the end of a limb is where it is wanted, and the limb stays."""


def plant(
    rig: PosedBody,
    feet: SourceFeet,
    soles: tuple[Annotated[Floats, "feet"], Annotated[Floats, "feet 3"]],
    limited: bool,
    rate: float,
) -> tuple[PosedBody, PosedBody, Annotated[Floats, "frames feet"], Frames]:
    """Return the poses with the feet on their paths, and those before.

    Further the depths (F, 2) of soles below the floor, and how much the pelvis was lowered (F,), m.
    feet: of the motion, in proportion. soles: heights (2,) of the joints that stand above the
    soles, and vectors (2, 3) at rest from the ankles to the soles below, m. limited: whether the
    depth of the soles is limited.
    """
    heights, _ = soles
    copied = _at(rig, feet.roles)
    target_heights = feet.paths @ UP + heights - feet.heights
    rig = rig.moved(_pelvis_height(target_heights - copied @ UP, feet.standing, rate)[:, None] * UP)
    copied = _at(rig, feet.roles)
    paths = plan_paths(feet, copied, heights, rate)
    depths = sole_depths(rig, soles, feet.floors, paths, paths - copied)
    if limited:
        paths += limited_lifts(depths)[..., None] * UP
    legs = [
        rig.limb((side + "UpperLeg", side + "LowerLeg", side + "Foot", role))
        if role != side + "Foot"
        else rig.limb((side + "UpperLeg", side + "LowerLeg", role))
        for side, role in zip(SIDES, feet.roles, strict=True)
    ]
    targets = [
        poses.position(leg.lower) + paths[:, foot] - copied[:, foot]
        for foot, (leg, poses) in enumerate(legs)
    ]
    needs = [
        body_plans.need(poses, leg, target, np.zeros(len(target)), limbs.firm_reach(poses, leg))
        for (leg, poses), target in zip(legs, targets, strict=True)
    ]
    largest = np.full(len(paths), DEEPEST * rig.body.leg_length)
    lowered = body_plans.lower(needs, largest, frame_groups.one_row(len(largest), rate))
    rotations = rig.rotations.copy()
    shift = -lowered[:, None] * UP
    for (leg, poses), target in zip(legs, targets, strict=True):
        turn_limb(rotations, leg, poses, shift, target)
    planted = PosedBody.of_rotations(rig.body, rotations, rig.roots + shift)
    still = np.zeros(paths.shape)
    depths = sole_depths(planted, soles, feet.floors, _at(planted, feet.roles), still)
    return planted, rig, depths, lowered


def turn_limb(
    rotations: Rotations, limb: Limb, poses: LimbPoses, shift: RootPath, target: RootPath
) -> None:
    """Turn a limb in poses (F, J, 4) so that its end comes to a target (F, 3), m.

    shift (F, 3): movement of its upper joint, m. Frames in which it is there stay as they are.
    """
    distances = np.linalg.norm(target - shift - poses.position(limb.lower), axis=-1)
    changed = distances > SAME
    if not changed.any():
        return
    before = rotations.copy()
    turns = limbs.solve(poses, limb, limbs.reach(poses, limb, shift, target))
    rotations[:, limb.upper], rotations[:, limb.middle], rotations[:, limb.lower] = turns
    rotations[~changed] = before[~changed]


def _at(rig: PosedBody, roles: tuple[str, str]) -> Annotated[Floats, "frames feet 3"]:
    """Return the positions (F, 2, 3), m, of the joints of two roles."""
    return np.stack([rig.of_role(role) for role in roles], axis=1)


def _pelvis_height(
    offsets: Annotated[Floats, "frames feet"],
    standing: Annotated[Booleans, "frames feet"],
    rate: float,
) -> Frames:
    """Return how much higher the pelvis has to be (F,), m, for the feet that stand, smoothly."""
    weights = standing.sum(axis=1).astype(float)
    if not weights.any():
        return np.full(len(offsets), float(np.median(offsets)))
    half = max(1, round(4.0 * SMOOTHING * rate))
    kernel = np.exp(-0.5 * np.square(np.arange(-half, half + 1) / (SMOOTHING * rate)))
    sums, totals = (
        np.convolve(np.pad(values, half), kernel, mode="valid")
        for values in ((offsets * standing).sum(axis=1), weights)
    )
    near_stances = np.flatnonzero(totals > 0.0)
    # Far from all stances those before and after count.
    return np.asarray(
        np.interp(np.arange(len(offsets)), near_stances, sums[near_stances] / totals[near_stances])
    )


def sole_depths(
    rig: PosedBody,
    soles: tuple[Annotated[Floats, "feet"], Annotated[Floats, "feet 3"]],
    floors: Annotated[Floats, "frames feet"],
    paths: Annotated[Floats, "frames feet 3"],
    shift: Annotated[Floats, "frames feet 3"],
) -> Annotated[Floats, "frames feet"]:
    """Return how deep the sole of each foot is below its floor (F, 2), m; negative above it.

    The deeper of ball and heel. floors (F, 2): heights, m. paths: of the joints that stand, m.
    shift: of the ankles against the poses (F, 2, 3), m.
    """
    heights, heels = soles
    depths = floors + heights - paths @ UP
    for foot, side in enumerate(SIDES):
        ankle = rig.body.joints[side + "Foot"]
        heel = rig.positions[:, ankle] + quat.rotate(rig.orientations[:, ankle], heels[foot])
        below = floors[:, foot] - (heel + shift[:, foot]) @ UP
        depths[:, foot] = np.maximum(depths[:, foot], below)
    return depths


def limited_lifts(depths: Floats) -> Floats:
    """Return by how much feet are lifted (F, 2), m, so that no sole is deeper than the limit.

    Depths up to FREE_DEPTH stay as they are; deeper ones approach the limit.
    """
    soft = MOST_DEPTH - FREE_DEPTH
    beyond = np.maximum(depths - FREE_DEPTH, 0.0)
    limited: Floats = beyond - soft * -np.expm1(-beyond / soft)
    return limited
