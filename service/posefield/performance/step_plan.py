"""Plans of people who step any way: cadence, phase, standing, and turns of the legs along a path.

The phase is tied to the distance; turns on the spot, ways to the side and a last step of each foot
after a stop advance it too. All is planned in the size of the model's body.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated, NamedTuple

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
"""Mean cadence of the last steps after a stop, cycles a second, their fewest cycles, and their
longest time, s."""
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
    root (S,). leans: how much these move by a rate of turning (S,), m s/rad.
    """

    walker: Walker
    poses: StandingPoses | None
    row: int
    speeds: Floats
    lengths: Floats
    durations: Floats
    drifts: Floats
    offsets: Annotated[FloorVectors, "speeds"]
    leans: Annotated[FloorVectors, "speeds"]


def find_striders(walkers: Sequence[Walker]) -> tuple[Strider, ...]:
    """Return the strides of walkers of one model."""
    poses, striders = find_standing_poses(walkers), []
    speeds = np.linspace(*walkers[0].gait.region.speeds, TABLE_SPEEDS)
    right, left = walkers[0].gait.region.turning(speeds)
    for row, walker in enumerate(walkers):
        controls = walker.controls(speeds, np.zeros(TABLE_SPEEDS))
        done, offsets = walker.strides(controls), walker.mean_offsets(controls)
        to_left, to_right = (walker.mean_offsets(walker.controls(speeds, s)) for s in (left, right))
        leans = (to_left - to_right) / np.maximum(left - right, 1e-6)
        tables = done.speeds, np.abs(done.travels), done.durations, done.drifts, offsets, leans
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
    region = table.walker.gait.region
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
    offsets, leans = (np.interp(forward, table.speeds, v) for v in (table.offsets, table.leans))
    offsets = offsets + walked * leans
    beyond = turning - walked
    course = Course(phases, moving, cadences, stepped, beyond, lengths, walked * durations)
    placed = place_feet(poses, row, (points, headings, points), course, low, rate)
    if poses is not None:
        offsets = offsets + placed.shares * (poses.points[row] - offsets)
    faced = headings - (1.0 - placed.shares) * drifts
    return StepPlan(
        forward,
        walked,
        phases,
        points - np.exp(1j * faced) * offsets,
        faced,
        *placed,
    )


class Course(NamedTuple):
    """Motion of a person in F frames besides the path.

    phases: without wrapping (F,). moving: whether the feet step (F,). cadences: (F,), cycles a
    second. velocities: in the frame of the body (F,), m/s. beyond: rates of turning beyond those of
    the model (F,), rad/s. lengths: of the model's stride (F,), m. turned: turns of its cycle (F,),
    rad.
    """

    phases: Frames
    moving: np.ndarray
    cadences: Frames
    velocities: Annotated[FloorVectors, "frames"]
    beyond: Frames
    lengths: Frames
    turned: Frames


class PlacedFeet(NamedTuple):
    """Share of the standing pose, and what keeps feet in their places, as of `Stepping`."""

    shares: Frames
    firm: Frames
    turns: Annotated[Floats, "frames 2"]
    shifts: Annotated[FloorVectors, "frames 2"]


def place_feet(
    poses: StandingPoses | None,
    row: int,
    path: tuple[Annotated[FloorVectors, "frames"], Frames, Annotated[FloorVectors, "frames"]],
    course: Course,
    slowest: float,
    rate: float,
) -> PlacedFeet:
    """Return how the legs of a person step along a path; without change for less than two feet.

    path: as of `plan_steps`, and points (F,) under which feet are set. slowest: of the model's
    speeds, m/s.
    """
    (points, headings, anchors), frames = path, len(path[0])
    steps = smooth(course.moving.astype(complex), EASE * rate, fixed=False).real
    firm = quat.smoothstep(np.clip(1.0 - steps, 0.0, 1.0))
    if poses is None:
        none = np.zeros((frames, 2))
        return PlacedFeet(np.zeros(frames), firm, none, none.astype(complex))
    speed = np.clip(np.abs(course.velocities.real) / slowest, 0.0, 1.0)
    shares = 1.0 - steps * np.maximum(LEAST_WALKED, np.sqrt(speed))
    shares = smooth(shares.astype(complex), EASE * rate, fixed=False).real
    # Of the turn and the way since the middle of a stance the stride has a part in its pose.
    passings, phases = poses.passings[row], course.phases
    middles, share = stepping.stances(phases, passings)
    first, last = np.where(course.moving[[0, -1]], phases[[0, -1]], [-np.inf, np.inf])
    before, after = (np.clip(middles + cycle, first, last) for cycle in (0.0, 1.0))
    strides = (1.0 - shares)[:, None] * (before + share * (after - before) - phases[:, None])
    turns = stepping.stepped(phases, headings, passings) - course.turned[:, None] * strides
    # Feet are wider apart by half a step to the side, or where toes turn in: none crosses.
    aside = np.abs(course.velocities.imag) + TOES * np.abs(course.beyond)
    widths = 0.25 * steps * aside / np.maximum(course.cadences, QUIET)
    placed = anchors[:, None] + np.outer(widths * np.exp(1j * headings), 1j * poses.sides)
    shifts = stepping.stepped(phases, placed, passings) + placed - points[:, None]
    shifts *= np.exp(-1j * headings)[:, None]
    shifts -= course.lengths[:, None] * strides
    return PlacedFeet(shares, firm, turns, shifts)


def stepping_of(
    walker: Walker, poses: StandingPoses | None, plans: Sequence[StepPlan | PlacedFeet]
) -> Stepping | None:
    """Return the steps of people whose plans have equally many frames; None without two feet."""
    if poses is None:
        return None
    names = "shares", "firm", "turns", "shifts"
    fields = (np.stack([getattr(plan, name) for plan in plans]) for name in names)
    return Stepping(poses, walker.card.skeleton.parents, *fields)


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
                share = np.minimum(np.arange(1, end - begin + 1) / max(count, 1), 1.0)
                phases[begin:end] = phase + cycles * share * (1.5 - 0.5 * share**2)
                moving[begin : begin + count] = True
            else:
                phases[begin:end] = phase + np.cumsum(cadences[begin:end]) / rate
        phase = float(phases[end - 1])
    return phases, moving
