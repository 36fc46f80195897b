"""Plans of people who step any way: cadence, phase, standing, and turns of the legs along a path.

The phase is tied to the distance; turns on the spot, ways to the side and a last step of each foot
after a stop advance it too. All is planned in the size of the model's body.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated

import numpy as np

from posefield.common.units import Floats, Frames
from posefield.locomotion import stepping
from posefield.locomotion.floor_plane import FloorVectors, smooth
from posefield.locomotion.stepping import StandingPoses, Stepping
from posefield.motion import quat
from posefield.performance import standing_pose
from posefield.performance.standing_pose import Walker

TABLE_SPEEDS, QUIET = 9, 0.12
"""Speeds at which strides and mean places of the root are known, with lines between, and the
cadence up to which a person stands, cycles a second."""
SLOW, SLOW_WINDOW = 0.2, 0.5
"""Speed below which steps follow the average velocity, m/s, and its standard deviation, s."""
SETTLING, LEAST_SETTLED, LAST_STEPS = 0.6, 0.5, 2.7
"""Mean cadence of the last steps after a stop, cycles a second, their fewest cycles, and the
longest time in which a person comes to stand, s."""
EASE, LEAST_WALKED = 0.1, 0.4
"""Standard deviation of the average with which standing and stepping are blended, s, and smallest
share of the walk in the pose of a person who steps."""
TOES, DRIFT = 0.1, 0.1
"""Distance of the balls of feet ahead of the axis about which they turn, m, and the distance to
which a slow body leaves its feet before they step, m."""
TURN_SPEED, TURN_EASE, FACED = 1.9, 0.5, 0.035
"""Mean rate of a turn on the spot, rad/s, the time that it takes besides, s, and least turn."""


@dataclass(frozen=True)
class Strider:
    """Standing pose of a walker, and its strides by speed, straight forward.

    poses: standing ones, of which `row` is the walker's; None for a model without two feet. speeds:
    (S,), m/s. lengths: (S,), m. durations: (S,), s. drifts: (S,), rad. offsets: mean points of the
    root (S,).
    """

    walker: Walker
    poses: StandingPoses | None
    row: int
    speeds: Floats
    lengths: Floats
    durations: Floats
    drifts: Floats
    offsets: Annotated[FloorVectors, "speeds"]


def find_striders(walkers: Sequence[Walker]) -> tuple[Strider, ...]:
    """Return the strides of walkers of one model."""
    poses, striders = find_standing_poses(walkers), []
    speeds = np.linspace(*walkers[0].gait.region.speeds, TABLE_SPEEDS)
    for row, walker in enumerate(walkers):
        controls = walker.controls(speeds, np.zeros(TABLE_SPEEDS))
        done, offsets = walker.strides(controls), walker.mean_offsets(controls)
        tables = done.speeds, np.abs(done.travels), done.durations, done.drifts, offsets
        striders.append(Strider(walker, poses, row, *tables))
    return tuple(striders)


def find_standing_poses(walkers: Sequence[Walker]) -> StandingPoses | None:
    """Return the standing poses of walkers; None for a model without two feet."""
    poses = [standing_pose.find_standing_pose(walker) for walker in walkers]
    poses_of_all = [pose for pose in poses if pose is not None]
    if len(poses_of_all) < len(poses):
        return None
    of_legs = [sorted((one.swinging, one.phase) for one in pose.passings) for pose in poses_of_all]
    passings = np.array(of_legs)[..., 1]
    return StandingPoses(
        np.stack([pose.rotations for pose in poses_of_all]),
        np.array([pose.height for pose in poses_of_all]),
        np.array([pose.place for pose in poses_of_all]),
        tuple(leg.upper for leg in poses_of_all[0].legs),
        np.sign(poses_of_all[0].balls.imag),
        passings,
        np.stack([walker.double_supports for walker in walkers]),
    )


def turn_seconds(angle: float) -> float:
    """Return the time of a turn on the spot by an angle, rad, in s."""
    return TURN_EASE + abs(angle) / TURN_SPEED


def turn_on_the_spot(start: float, facing: float, rate: float) -> Frames:
    """Return the headings (F,), rad, of the shorter turn to a heading; the first one for none."""
    angle = float(np.angle(np.exp(1j * (facing - start))))
    count = round(turn_seconds(angle) * rate) if abs(angle) > FACED else 0
    return start + angle * quat.smoothstep(np.linspace(0.0, 1.0, count + 1))


@dataclass(frozen=True)
class StepPlan:
    """Plan of a person, as of `LocomotionPlan` and `Stepping`; rates are those of controls."""

    speeds: Frames
    turning: Frames
    phases: Frames
    points: Annotated[FloorVectors, "frames"]
    headings: Frames
    shares: Frames
    firm: Frames
    turns: Annotated[Floats, "frames 2"]
    shifts: Annotated[FloorVectors, "frames 2"]


def plan_steps(
    table: Strider,
    path: tuple[Annotated[FloorVectors, "frames"], Frames],
    number: float,
    rate: float,
) -> StepPlan:
    """Return the plan of a person along a path.

    path: points (F,), m, and headings of the body (F,), rad. number: from 0 to 1, of the first
    phase. rate: frames a second.
    """
    (points, headings), velocities = path, np.gradient(path[0]) * rate
    region, frames = table.walker.gait.region, len(points)
    low, high = region.speeds
    slow = smooth(velocities, SLOW_WINDOW * rate, fixed=False)
    stepped = np.where(np.abs(velocities) < SLOW, slow, velocities) * np.exp(-1j * headings)
    forward = np.clip(stepped.real, low, high)
    lengths, durations, drifts = (
        np.interp(forward, table.speeds, values)
        for values in (table.lengths, table.durations, table.drifts)
    )
    turning = np.gradient(headings) * rate
    right, left = region.turning(forward)
    walked = np.clip(turning, right, left) * quat.smoothstep(np.clip(stepped.real / low, 0.0, 1.0))
    cadences = stepping.cadences(
        stepped.real, stepped.imag, turning - walked, (lengths, durations), low
    )
    poses, row = table.poses, table.row
    supports = np.zeros(2) if poses is None else poses.supports[row]
    first = int(np.argmax(cadences > QUIET))
    if poses is not None and abs(stepped.imag[first]) > abs(stepped.real[first]):
        lead = poses.passings[row, np.argmax(poses.sides * stepped.imag[first])]
        number = 0.5 * float(np.argmin((lead - supports) % 1.0))
    phases, moving = _phases(cadences, supports, number, rate, points)
    steps = smooth(moving.astype(complex), EASE * rate, fixed=False).real
    speed = np.clip(np.abs(stepped.real) / low, 0.0, 1.0)
    shares = 1.0 - steps * np.maximum(LEAST_WALKED, np.sqrt(speed))
    shares = smooth(shares.astype(complex), EASE * rate, fixed=False).real
    offsets = np.interp(forward, table.speeds, table.offsets)
    turns, shifts = np.zeros((frames, 2)), np.zeros((frames, 2), complex)
    if poses is not None:
        # Of the turn and the way since the middle of a stance the stride has a part in its pose.
        passings = poses.passings[row]
        strides = (1.0 - shares)[:, None] * stepping.stepped(phases, phases, passings)
        turns = stepping.stepped(phases, headings, passings)
        turns -= (walked * durations)[:, None] * strides
        # Feet are wider apart by half a step to the side, or where toes turn in: none crosses.
        aside = np.abs(stepped.imag) + TOES * np.abs(turning - walked)
        apart = 0.25 * steps * aside / np.maximum(cadences, QUIET)
        placed = points[:, None] + np.outer(apart * np.exp(1j * headings), 1j * poses.sides)
        shifts = stepping.stepped(phases, placed, passings) + placed - points[:, None]
        shifts *= np.exp(-1j * headings)[:, None]
        shifts -= lengths[:, None] * strides
        offsets = offsets + shares * (poses.points[row] - offsets)
    else:
        shares = np.zeros(frames)
    faced = headings - (1.0 - shares) * drifts
    return StepPlan(
        forward,
        walked,
        phases,
        points - np.exp(1j * faced) * offsets,
        faced,
        shares,
        quat.smoothstep(np.clip(1.0 - steps, 0.0, 1.0)),
        turns,
        shifts,
    )


def stepping_of(strider: Strider, plans: Sequence[StepPlan]) -> Stepping | None:
    """Return the steps of people whose plans have equally many frames; None without two feet."""
    if strider.poses is None:
        return None
    names = "shares", "firm", "turns", "shifts"
    fields = (np.stack([getattr(plan, name) for plan in plans]) for name in names)
    return Stepping(strider.poses, strider.walker.card.skeleton.parents, *fields)


def _phases(
    cadences: Frames,
    supports: Annotated[Floats, "2"],
    number: float,
    rate: float,
    points: Annotated[FloorVectors, "frames"],
) -> tuple[Frames, np.ndarray]:
    """Return phases (F,), without wrapping, and whether a person steps (F,).

    supports: phases in which both feet stand. number: from 0 to 1. After a stop each foot takes one
    more step, to its place under the body, and again where points (F,), m, of the body leave it.
    """
    moving = cadences > QUIET
    steps = np.where(moving, cadences, 0.0) / rate
    edges = [0, *(np.flatnonzero(np.diff(moving)) + 1).tolist(), len(cadences)]
    for begin, end in list(pairwise(edges)):
        at = end if moving[begin] else begin
        while (far := np.abs(points[at:end] - points[min(at, len(points) - 1)]) > DRIFT).any():
            at += int(np.argmax(far))
            edges.append(at)
    phases = np.empty(len(cadences))
    phase = number if moving[0] else float(supports[int(number * 2.0) % 2])
    for begin, end in pairwise(sorted(edges)):
        if moving[begin]:
            phases[begin:end] = phase + np.cumsum(steps[begin:end])
        elif begin == 0:
            phases[begin:end] = phase
        else:
            waits = (supports - phase - LEAST_SETTLED) % 1.0
            cycles = LEAST_SETTLED + float(waits.min())
            count = int(cycles / SETTLING * rate)
            if end - begin > count:
                share = np.minimum(np.arange(1, end - begin + 1) / count, 1.0)
                phases[begin:end] = phase + cycles * share * (1.5 - 0.5 * share**2)
                moving[begin : begin + count] = True
            else:
                phases[begin:end] = phase + np.cumsum(cadences[begin:end]) / rate
        phase = float(phases[end - 1])
    return phases, moving
