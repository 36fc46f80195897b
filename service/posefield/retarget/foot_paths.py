"""Paths of the feet of a rig: where the motion's feet stand the rig's stand too.

A foot of the rig is at the path of the motion's, in proportion to the legs, but for a distance over
the floor that is constant in each stance and changes smoothly in swings. So it slides as the
motion's foot does: not at all where that is exact.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated

import numpy as np

from posefield.common.array_shapes import RootPath
from posefield.common.units import UP, Booleans, Floats, Indices
from posefield.feet import contact_estimates, stances
from posefield.feet.stances import UNEVEN, FootPath, Interval
from posefield.question.results import StanceResult
from posefield.retarget.role_map import SIDES, Body

FADE = 0.1
"""Time over which a correction settles before the first stance and after the last, s."""
HIGHEST_FOOT = 0.2
"""Largest height at rest of a joint that stands, as a share of the leg."""
FLOOR = 1.0 - UP


@dataclass(frozen=True)
class SourceFeet:
    """Feet of a motion, left and right, in proportion to a rig's legs.

    roles: of the joints that contact. paths (F, 2, 3), m. standing (F, 2): whether each stands.
    heights (2,): of the joints while they stand, m.
    """

    roles: tuple[str, str]
    paths: Annotated[Floats, "frames feet 3"]
    stances: tuple[tuple[Interval, ...], ...]
    heights: Annotated[Floats, "feet"]

    @property
    def standing(self) -> Annotated[Booleans, "frames feet"]:
        """Return whether each foot stands in each frame (F, 2)."""
        found = [stances.mask(own, len(self.paths)) for own in self.stances]
        return np.stack(found, axis=1)

    @property
    def floors(self) -> Annotated[Floats, "frames feet"]:
        """Return the height of the floor below each foot (F, 2), m.

        As each stance has it; between two the lower one, so that feet may step up and down.
        """
        found = np.empty(self.paths.shape[:2])
        for foot, own in enumerate(self.stances):
            heights = self.paths[:, foot] @ UP
            level = [float(np.median(heights[s.begin : s.end])) for s in own]
            level = level or [float(self.heights[foot])]
            edges = [0, *(s.end for s in own[:-1]), len(heights)]
            begins = [s.begin for s in own] or [0]
            for index, (first, last) in enumerate(pairwise(edges)):
                found[first:last, foot] = level[index]
                swing = slice(first, begins[index])
                found[swing, foot] = min(level[max(index - 1, 0)], level[index])
        return found - self.heights


def contact_roles(source: Body, rig: Body) -> tuple[str, str]:
    """Return the roles of the joints that stand: toes where both bodies have them, or feet."""
    both = {side + "Toes" for side in SIDES} <= source.joints.keys() & rig.joints.keys()
    left, right = (side + ("Toes" if both else "Foot") for side in SIDES)
    return left, right


def feet_of(
    paths: Annotated[Floats, "frames feet 3"],
    rate: float,
    roles: tuple[str, str],
    names: tuple[str, str],
    told: Sequence[StanceResult] | None,
) -> SourceFeet:
    """Return the feet of a motion.

    paths: of the joints that contact, in proportion to the rig. names: of these joints. told: their
    stances; None to detect them.
    """
    own = [FootPath(paths[:, foot], rate) for foot in range(2)]
    if told is None:
        # A single pose has no speeds.
        found = contact_estimates.from_motion(own) if len(paths) > 1 else [[], []]
    else:
        found = [_stances(told, name, rate, len(paths)) for name in names]
    heights = [
        contact_estimates.statistics(foot, path, down).height
        for foot, (path, down) in enumerate(zip(own, found, strict=True))
    ]
    return SourceFeet(roles, paths, tuple(map(tuple, found)), np.array(heights))


def _stances(told: Sequence[StanceResult], name: str, rate: float, frames: int) -> list[Interval]:
    """Return the frames of the stances of a joint."""
    found = []
    for own in told:
        begin, end = round(own.begin * rate), min(round(own.end * rate) + 1, frames)
        if own.joint == name and begin < end:
            found.append(Interval(begin, end))
    return found


def standing_heights(feet: SourceFeet, rig: Body) -> Annotated[Floats, "feet"]:
    """Return the heights (2,), m, of the rig's joints while they stand.

    Those above the floor of the file, if it stands on one at rest, and else those of the motion.
    Differences as between the soles of captured performers are left as they are.
    """
    rest = np.array([rig.rest[rig.joints[role]][1] for role in feet.roles])
    known = 0.0 <= rest.min() and rest.max() <= HIGHEST_FOOT * rig.leg_length
    same = abs(float(np.mean(rest - feet.heights))) <= UNEVEN
    return feet.heights if same or not known or np.ptp(rest) > UNEVEN else rest


def plan_paths(
    feet: SourceFeet,
    copied: Annotated[Floats, "frames feet 3"],
    heights: Annotated[Floats, "feet"],
    rate: float,
) -> Annotated[Floats, "frames feet 3"]:
    """Return the paths (F, 2, 3), m, of the rig's feet.

    copied: those of copied orientations. heights (2,): while the rig's feet stand, m.
    """
    found = feet.paths + (heights - feet.heights)[:, None] * UP
    for foot, own in enumerate(feet.stances):
        apart = (copied[:, foot] - feet.paths[:, foot]) * FLOOR
        found[:, foot] += apart + _correction(apart, own, rate)
    return found


def _correction(apart: RootPath, found: Sequence[Interval], rate: float) -> RootPath:
    """Return the change (F, 3) of a distance with which it is constant in each stance.

    Between stances it is a cubic with the values and slopes at their ends, before the first and
    after the last it settles at a constant.
    """
    change = np.zeros(apart.shape)
    if not found:
        return change
    slopes = np.gradient(apart, axis=0) if len(apart) > 1 else np.zeros(apart.shape)
    for own in found:
        inside = slice(own.begin, own.end)
        change[inside] = apart[inside].mean(axis=0) - apart[inside]
    for before, after in pairwise(found):
        last, first = before.end - 1, after.begin
        shares = np.arange(1, first - last)[:, None] / (first - last)
        ends = (change[last], change[first])
        ways = (-(first - last) * slopes[last], -(first - last) * slopes[first])
        change[last + 1 : first] = _cubic(ends, ways, shares)
    begin, end = found[0].begin, found[-1].end
    change[:begin] = _settled(change[begin], slopes[begin], np.arange(begin, 0, -1), rate)
    steps = np.arange(1, len(apart) - end + 1)
    change[end:] = _settled(change[end - 1], -slopes[end - 1], steps, rate)
    return change


def _cubic(
    ends: tuple[Floats, Floats], ways: tuple[Floats, Floats], share: Floats
) -> Annotated[Floats, "some 3"]:
    """Return the cubic (S, 3) between two values with slopes, at shares (S, 1)."""
    s = share
    found: Floats = (
        (2 * s**3 - 3 * s**2 + 1) * ends[0]
        + (s**3 - 2 * s**2 + s) * ways[0]
        + (3 * s**2 - 2 * s**3) * ends[1]
        + (s**3 - s**2) * ways[1]
    )
    return found


def _settled(
    value: Floats, slope: Floats, steps: Annotated[Indices, "some"], rate: float
) -> Annotated[Floats, "some 3"]:
    """Return values (S, 3) some steps away from one with a slope by step, which fades."""
    fade = FADE * rate
    found: Floats = value + slope * (fade * -np.expm1(-steps / fade))[:, None]
    return found
