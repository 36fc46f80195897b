"""Hands of a rig that meet the exact targets of the motion's hands."""

from collections.abc import Sequence
from typing import Annotated

import numpy as np

from posefield.common.array_shapes import Frames, RootPath
from posefield.common.errors import InvalidField
from posefield.common.units import Floats
from posefield.motion import blend
from posefield.retarget import planted_legs
from posefield.retarget.planted_legs import PosedRig
from posefield.retarget.retarget_report import HandGoal

FADE = 0.4
"""Time before and after a goal over which the arm turns to it and back, s."""
ARMS = {
    side + "Hand": tuple(side + part for part in ("UpperArm", "LowerArm", "Hand"))
    for side in ("left", "right")
}


def check_goals(goals: Sequence[HandGoal], rig: PosedRig, rate: float) -> None:
    """Raise InvalidField for a goal of no hand of the rig, or outside the motion."""
    last = (len(rig.roots) - 1) / rate
    for goal in goals:
        lacking = [role for role in ARMS.get(goal.role, ()) if role not in rig.body.joints]
        if goal.role not in ARMS or lacking:
            said = f", but the character has no {', '.join(lacking)}" if lacking else ""
            raise InvalidField(
                "character", f"with a goal of {goal.role!r}{said}; expected a hand of it"
            )
        if not -1e-6 <= goal.time <= goal.end <= last + 1e-6:
            raise InvalidField(
                "character",
                f"with a goal at {goal.time:g} s until {goal.end:g} s, expected 0 to {last:g} s",
            )


def meet_goals(rig: PosedRig, goals: Sequence[HandGoal], rate: float) -> PosedRig:
    """Return poses in which each hand is at its goals at their times.

    A hand is moved by its distance from the goal, less before and after it. Out of reach it comes
    near.
    """
    if not goals:
        return rig
    rotations = rig.rotations.copy()
    times = np.arange(len(rotations)) / rate
    for role, roles in ARMS.items():
        own = [goal for goal in goals if goal.role == role]
        if not own:
            continue
        hand, moved = rig.of_role(role), np.zeros(rig.roots.shape)
        for goal in own:
            there = np.clip(times, goal.time, goal.end)
            apart = np.asarray(goal.position) - _at(hand + moved, there * rate)
            moved += _shares(times - there, goal, own)[:, None] * apart
        limb, poses = rig.limb(roles)
        planted_legs.turn_limb(rotations, limb, poses, np.zeros(rig.roots.shape), hand + moved)
    return planted_legs.posed(rig.body, rotations, rig.roots)


def _at(path: RootPath, places: Annotated[Floats, "places"]) -> Annotated[Floats, "places 3"]:
    """Return the points (N, 3) of a path (F, 3) at fractional frames (N,)."""
    if len(path) < 2:
        return path[[0] * len(places)]
    return blend.interpolate_rows(path, np.clip(places, 0, len(path) - 1))


def _shares(away: Frames, goal: HandGoal, goals: Sequence[HandGoal]) -> Frames:
    """Return the shares (F,) of a goal: 1 at its times, 0 from the next and the last goals on.

    away (F,): time since the goal, negative before it, s.
    """
    before = min([FADE, *(gap for own in goals if (gap := goal.time - own.end) > 0.0)])
    after = min([FADE, *(gap for own in goals if (gap := own.time - goal.end) > 0.0)])
    found: Frames = blend.smoothstep(
        np.clip(1.0 - np.where(away < 0.0, -away / before, away / after), 0.0, 1.0)
    )
    return found


def misses(rig: PosedRig, goals: Sequence[HandGoal], rate: float) -> tuple[float, ...]:
    """Return the largest distance of each hand from its goal, m."""
    return tuple(
        float(np.linalg.norm(goal.position - path, axis=-1).max())
        for goal in goals
        for path in [_at(rig.of_role(goal.role), _frames(goal, rate))]
    )


def _frames(goal: HandGoal, rate: float) -> Annotated[Floats, "places"]:
    """Return the fractional frames of a goal: its first and last, and all between them."""
    first, last = goal.time * rate, goal.end * rate
    between = np.arange(np.floor(first) + 1.0, np.ceil(last))
    return np.concatenate([[first], between, [last]])
