"""Plans of people on tracks: cadence, phase, standing and turns of the legs along their paths.

The phase is tied to the distance; turns on the spot, ways to the side and a last step of each foot
after a stop advance it too. All is planned in the size of the model's body: a person who is taller
by a share walks a path that is shorter by it.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

import numpy as np

from posefield.common.units import Floats, Frames, Indices, PerCharacter
from posefield.locomotion import stepping
from posefield.locomotion.floor_plane import FloorVectors
from posefield.locomotion.gait import Gait
from posefield.locomotion.locomotion_plan import LocomotionPlan
from posefield.locomotion.stepping import StandingPoses, Stepping
from posefield.motion import quat
from posefield.performance import standing_pose
from posefield.performance.standing_pose import Walker
from posefield.tracks.track_path import TrackPath, smooth

KNOT_SECONDS = 0.2
"""Time between points at which controls are solved, s, with lines between."""
TABLE_SPEEDS = 9
"""Speeds at which strides and mean places of the root are known; lines between."""
QUIET = 0.12
"""Cadence up to which a person stands, cycles a second."""
SLOW, SLOW_WINDOW = 0.2, 0.5
"""Speed below which steps follow the average velocity, m/s, and its standard deviation, s."""
SETTLING, LEAST_SETTLED = 0.6, 0.5
"""Mean cadence of the last steps after a stop, cycles a second, and their fewest cycles."""
EASE = 0.1
"""Standard deviation of the average with which standing and stepping are blended, s."""
LEAST_WALKED = 0.4
"""Smallest share of the walk in the pose of a person who steps."""
SWAYS = ((0.11, 0.016, 0.006), (0.23, 0.007, 0.004), (0.41, 0.003, 0.003))
"""Frequencies of the sway of a person who stands, 1/s, and how far it goes to the side and forward,
m: shifts of the weight, and what keeps the balance (Winter 1995 reports some millimetres)."""


@dataclass(frozen=True)
class Strider:
    """Strides of one combination of labels by speed, straight forward.

    speeds: (S,), m/s. lengths: (S,), m. durations: (S,), s. drifts: (S,), rad. offsets: mean points
    of the root (S,).
    """

    speeds: Floats
    lengths: Floats
    durations: Floats
    drifts: Floats
    offsets: Annotated[FloorVectors, "speeds"]


@dataclass(frozen=True)
class TrackWalkers:
    """Walkers of a model whose people follow tracks, by combination of labels."""

    gait: Gait

    @cached_property
    def walkers(self) -> tuple[Walker, ...]:
        """Walker of each combination of labels; the last one has none."""
        weights = self.gait.labels.weights
        return tuple(
            Walker(self.gait, weights[index : index + 1], self.gait.performer_offsets[index], {})
            for index in range(len(weights))
        )

    @cached_property
    def striders(self) -> tuple[Strider, ...]:
        """Strides of each combination of labels."""
        speeds = np.linspace(*self.gait.region.speeds, TABLE_SPEEDS)
        tables = []
        for walker in self.walkers:
            controls = walker.controls(speeds, np.zeros(TABLE_SPEEDS))
            done = walker.strides(controls)
            offsets = walker.mean_offsets(controls)
            lengths = np.abs(done.travels)
            tables.append(Strider(done.speeds, lengths, done.durations, done.drifts, offsets))
        return tuple(tables)

    @cached_property
    def standing(self) -> StandingPoses | None:
        """Standing poses of all combinations; None for a model without two feet."""
        poses = [standing_pose.find_standing_pose(walker) for walker in self.walkers]
        if any(pose is None for pose in poses):
            return None
        poses_of_all = [pose for pose in poses if pose is not None]
        passings = np.empty((len(poses_of_all), 2))
        for row, pose in zip(passings, poses_of_all, strict=True):
            for passing in pose.passings:
                row[passing.swinging] = passing.phase
        return StandingPoses(
            np.stack([pose.rotations for pose in poses_of_all]),
            np.array([pose.height for pose in poses_of_all]),
            np.array([pose.place for pose in poses_of_all]),
            tuple(leg.upper for leg in poses_of_all[0].legs),
            passings,
            np.stack([walker.double_supports for walker in self.walkers]),
        )


@dataclass(frozen=True)
class _PersonPlan:
    """Plan of one person in F frames, as of `LocomotionPlan` and `Stepping`; rates for controls."""

    speeds: Frames
    turning: Frames
    phases: Frames
    points: Annotated[FloorVectors, "frames"]
    headings: Frames
    shares: Frames
    firm: Frames
    turns: Annotated[Floats, "frames 2"]
    shifts: Annotated[FloorVectors, "frames 2"]


def plan_people(
    walkers: TrackWalkers,
    paths: Sequence[TrackPath],
    combinations: Annotated[Indices, "people"],
    numbers: Annotated[Floats, "people 2"],
    scales: PerCharacter,
    rate: float,
) -> LocomotionPlan:
    """Return the plan of people (N) whose paths have equal lengths.

    combinations: of labels of each. numbers: random ones from 0 to 1, of the phase and of the
    sway. scales: heights over those of the model.
    """
    gait, frames = walkers.gait, len(paths[0])
    plans = [
        _plan_person(walkers, path, int(combination), draw, scale, rate)
        for path, combination, draw, scale in zip(
            paths, combinations, numbers, scales.tolist(), strict=True
        )
    ]
    columns = {name: np.stack([getattr(plan, name) for plan in plans]) for name in vars(plans[0])}
    knots = np.unique(np.append(np.arange(0, frames, max(1, int(KNOT_SECONDS * rate))), frames - 1))
    everyone = np.repeat(combinations, len(knots))
    solved = gait.controls(
        columns["speeds"][:, knots].ravel(), columns["turning"][:, knots].ravel(), everyone
    ).reshape(len(paths), len(knots), -1)
    at = np.interp(np.arange(frames), knots, np.arange(len(knots)))
    before = np.minimum(at.astype(np.int64), max(len(knots) - 2, 0))
    share = (at - before)[:, None]
    after = np.minimum(before + 1, len(knots) - 1)
    controls = (1.0 - share) * solved[:, before] + share * solved[:, after]
    steps = None
    if walkers.standing is not None:
        parents = gait.session.card.skeleton.parents
        fields = (columns[name] for name in ("shares", "firm", "turns", "shifts"))
        steps = Stepping(walkers.standing, parents, *fields)
    return LocomotionPlan(
        controls,
        combinations,
        columns["phases"] % 1.0,
        columns["points"],
        columns["headings"],
        rate,
        gait.labels,
        steps,
    )


def _plan_person(
    walkers: TrackWalkers,
    path: TrackPath,
    labels: int,
    numbers: Annotated[Floats, "2"],
    scale: float,
    rate: float,
) -> _PersonPlan:
    table, standing = walkers.striders[labels], walkers.standing
    frames, headings = len(path), path.headings
    points, velocities = path.points / scale, path.velocities / scale
    low, high = walkers.gait.region.speeds
    slow = smooth(velocities, SLOW_WINDOW * rate, fixed=False)
    stepped = np.where(np.abs(velocities) < SLOW, slow, velocities) * np.exp(-1j * headings)
    forward = np.clip(stepped.real, low, high)
    lengths, durations, drifts = (
        np.interp(forward, table.speeds, values)
        for values in (table.lengths, table.durations, table.drifts)
    )
    turning = np.gradient(headings) * rate
    right, left = walkers.gait.region.turning(forward)
    walked = np.clip(turning, right, left) * quat.smoothstep(np.clip(stepped.real / low, 0.0, 1.0))
    cadences = stepping.cadences(
        stepped.real, stepped.imag, turning - walked, (lengths, durations), low
    )
    supports = standing.supports[labels] if standing else np.zeros(2)
    phases, moving = _phases(cadences, supports, float(numbers[0]), rate)
    steps = smooth(moving.astype(complex), EASE * rate, fixed=False).real
    speed = np.clip(np.abs(stepped.real) / low, 0.0, 1.0)
    shares = 1.0 - steps * np.maximum(LEAST_WALKED, np.sqrt(speed))
    shares = smooth(shares.astype(complex), EASE * rate, fixed=False).real
    offsets = np.interp(forward, table.speeds, table.offsets)
    turns, shifts = np.zeros((frames, 2)), np.zeros((frames, 2), complex)
    if standing is not None:
        # Of the turn and the way since the middle of a stance the stride has a part in its pose.
        passings = standing.passings[labels]
        strides = (1.0 - shares)[:, None] * stepping.stepped(phases, phases, passings)
        turns = stepping.stepped(phases, headings, passings)
        turns -= (walked * durations)[:, None] * strides
        shifts = stepping.stepped(phases, points, passings) * np.exp(-1j * headings)[:, None]
        shifts -= lengths[:, None] * strides
        offsets = offsets + shares * (standing.points[labels] - offsets)
    else:
        shares = np.zeros(frames)
    faced = headings - (1.0 - shares) * drifts
    swayed = shares**2 * _sway(frames, float(numbers[1]), rate) - offsets
    return _PersonPlan(
        forward,
        walked,
        phases,
        points + np.exp(1j * faced) * swayed,
        faced,
        shares,
        quat.smoothstep(np.clip(1.0 - steps, 0.0, 1.0)),
        turns,
        shifts,
    )


def _phases(
    cadences: Frames, supports: Annotated[Floats, "2"], number: float, rate: float
) -> tuple[Frames, np.ndarray]:
    """Return phases (F,), without wrapping, and whether a person steps (F,).

    supports: phases in which both feet stand. number: from 0 to 1. After a stop each foot takes one
    more step, to its place under the body, if there is time.
    """
    moving = cadences > QUIET
    steps = np.where(moving, cadences, 0.0) / rate
    edges = np.flatnonzero(np.diff(moving)) + 1
    phases = np.empty(len(cadences))
    phase = number if moving[0] else float(supports[int(number * 2.0) % 2])
    for begin, end in zip([0, *edges], [*edges, len(cadences)], strict=True):
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


def _sway(frames: int, number: float, rate: float) -> Annotated[FloorVectors, "frames"]:
    """Return the sway (F,) of a person who stands, in the frame that travels."""
    times = np.arange(frames) / rate
    sway = np.zeros(frames, complex)
    for index, (frequency, side, forward) in enumerate(SWAYS):
        turn = 2.0 * np.pi * (frequency * times * (1.0 + 0.2 * number) + (index + 3.0) * number)
        sway += forward * np.sin(1.3 * turn + 1.0) + 1j * side * np.sin(turn)
    return sway
