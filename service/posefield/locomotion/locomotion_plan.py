"""Paths on the floor, and plans along them: positions, phases, controls and levels of detail.

A plan is cheap and computed for all characters and frames at once. Poses are computed for any pairs
of character and frame. Between two levels, poses of both are blended over a quarter of a second;
the levels are known in advance, so a finer one is complete before the coarser would be noticed.
"""

from dataclasses import dataclass, replace
from typing import Annotated, TypeVar

import numpy as np

from posefield.common import cancellation
from posefield.common.units import (
    CharacterFrames,
    CharacterPoints,
    Floats,
    Indices,
    PerCharacter,
)
from posefield.inference import level_selection
from posefield.inference.level_selection import HYSTERESIS, Camera, LevelTable
from posefield.inference.session import Session
from posefield.locomotion import floor_plane, stride
from posefield.locomotion.floor_plane import FloorVectors
from posefield.locomotion.gait import Gait, WalkerLabels
from posefield.locomotion.stepping import Stepping
from posefield.locomotion.stride import RelativePoses, Strides
from posefield.motion import quat

# Distance between known points of a path, m. Heading is linear between them.
POINT_SPACING = 0.1


@dataclass(frozen=True)
class Paths:
    """N paths, each known at K points that lie `POINT_SPACING` apart along it.

    starts: (N,), first points. headings: (N, K), rad, of the tangents, without jumps; between two
    points a path is an arc. speeds: (N, K), m/s.
    """

    starts: Annotated[FloorVectors, "characters"]
    headings: CharacterPoints
    speeds: CharacterPoints

    @property
    def curvatures(self) -> CharacterPoints:
        """Curvature (N, K), 1/m, positive to the left."""
        return np.gradient(self.headings, POINT_SPACING, axis=1)

    @property
    def places(self) -> Annotated[FloorVectors, "characters points"]:
        """Known points of the paths (N, K)."""
        turns = np.diff(self.headings, axis=1)
        steps = floor_plane.unit_vectors(self.headings[:, :-1]) * floor_plane.arc_displacement(
            np.array(POINT_SPACING), turns
        )
        return self.starts[:, None] + np.pad(np.cumsum(steps, axis=1), ((0, 0), (1, 0)))

    def at(
        self, gone: CharacterFrames
    ) -> tuple[Annotated[FloorVectors, "characters frames"], CharacterFrames]:
        """Return points (N, F) and headings (N, F), rad, of the tangents after (N, F) metres."""
        before, share = self._between(gone)
        turns = share * np.take_along_axis(np.diff(self.headings, axis=1), before, axis=1)
        first = np.take_along_axis(self.headings, before, axis=1)
        along = floor_plane.unit_vectors(first) * floor_plane.arc_displacement(
            POINT_SPACING * share, turns
        )
        return np.take_along_axis(self.places, before, axis=1) + along, first + turns

    def interpolate(
        self,
        values: Annotated[Floats, "characters points *values"],
        gone: CharacterFrames,
    ) -> Annotated[Floats, "characters frames *values"]:
        """Return values (N, K, ...) of the known points after (N, F) metres: (N, F, ...)."""
        before, share = self._between(gone)
        rows = np.arange(len(values))[:, None]
        share = share.reshape(*share.shape, *[1] * (values.ndim - 2))
        return (1.0 - share) * values[rows, before] + share * values[rows, before + 1]

    def _between(
        self, gone: CharacterFrames
    ) -> tuple[Annotated[Indices, "characters frames"], CharacterFrames]:
        before = np.minimum((gone / POINT_SPACING).astype(np.int64), self.headings.shape[1] - 2)
        return before, gone / POINT_SPACING - before


@dataclass(frozen=True)
class Route:
    """Waypoints (P, 2) in order, x to the left and z forward, m, and one speed, m/s."""

    waypoints: Floats
    speed: float


Numbers = TypeVar("Numbers", Floats, FloorVectors)


@dataclass(frozen=True)
class LocomotionPlan:
    """Locomotion of N characters at F frames, without their poses.

    controls: (N, F, d). who: (N,), index into `labels`. phases: (N, F), of the cycle, in [0, 1).
    places: (N, F) and headings: (N, F), rad, of the frames that travel with the characters. rate:
    frames a second. stepping: steps and standing; None for walkers that only walk ahead.
    """

    controls: Annotated[Floats, "characters frames controls"]
    who: Annotated[Indices, "characters"]
    phases: CharacterFrames
    places: Annotated[FloorVectors, "characters frames"]
    headings: CharacterFrames
    rate: float
    labels: WalkerLabels
    stepping: Stepping | None = None

    @property
    def roots(self) -> Annotated[Floats, "characters frames 3"]:
        """Points (N, F, 3), m, on the floor under the characters."""
        return floor_plane.at_height(self.places, np.zeros(self.places.shape))

    def relative_to_start(self) -> "LocomotionPlan":
        """Return the plan with each character in the frame of its start."""
        first, facing = self.places[:, :1], self.headings[:, :1]
        points = (self.places - first) * floor_plane.unit_vectors(-facing)
        return replace(self, places=points, headings=self.headings - facing)


def plan_from_controls(
    gait: Gait,
    controls: Annotated[Floats, "characters frames controls"],
    combinations: Annotated[Indices, "characters"],
    phases: PerCharacter,
    starts: tuple[Annotated[FloorVectors, "characters"], PerCharacter],
    rate: float,
) -> LocomotionPlan:
    """Return the plan of controls (N, F, d); the trajectories follow from the model's travel.

    phases: (N,) and starts: places (N,) and headings (N,), rad, at the first frame.
    """
    cycles = _measure_strides(gait, controls, combinations)
    turns = _increments(cycles.turning, rate)
    ways = _increments(cycles.travels / cycles.durations, rate)
    headings = starts[1][:, None] + _cumulative_sums(turns)
    steps = floor_plane.unit_vectors(headings[:, :-1]) * floor_plane.arc_displacement(ways, turns)
    points = starts[0][:, None] + _cumulative_sums(steps)
    began = _phases(cycles, phases, rate)
    return LocomotionPlan(controls, combinations, began, points, headings, rate, gait.labels)


def plan_along_paths(
    gait: Gait,
    paths: Paths,
    combinations: Annotated[Indices, "characters"],
    phases: PerCharacter,
    frames: int,
    rate: float,
) -> LocomotionPlan:
    """Return the plan of characters along paths, at the speed of the synthesised gait.

    phases: (N,), of the cycle at the first frame.
    """
    shape = paths.speeds.shape
    everyone = np.repeat(combinations, shape[1])
    turning = (paths.speeds * paths.curvatures).ravel()
    point_controls = gait.controls(paths.speeds.ravel(), turning, everyone)
    labels = stride.RowLabels(gait.labels.weights, everyone)
    speeds = stride.strides(gait.session, point_controls, labels).speeds.reshape(shape)
    gone = _distances(speeds, frames, rate)
    controls = paths.interpolate(point_controls.reshape(*shape, -1), gone)
    cycles = _measure_strides(gait, controls, combinations)
    points, tangents = paths.at(gone)
    headings, began = tangents - cycles.drifts, _phases(cycles, phases, rate)
    return LocomotionPlan(controls, combinations, began, points, headings, rate, gait.labels)


def synthesize_poses(
    session: Session,
    plan: LocomotionPlan,
    characters: Annotated[Indices, "poses"],
    frames: Annotated[Indices, "poses"],
    level: int = 0,
) -> RelativePoses:
    """Return the poses of K pairs of a character (K,) and a frame (K,) of the plan."""
    labels = plan.labels.weights[plan.who[characters]]
    pair = characters, frames
    relative = stride.synthesize_poses(
        session, plan.controls[pair], labels, plan.phases[pair], level
    )
    return place_poses(plan, pair, relative)


def place_poses(
    plan: LocomotionPlan,
    pair: tuple[Annotated[Indices, "poses"], Annotated[Indices, "poses"]],
    poses: RelativePoses,
) -> RelativePoses:
    """Return poses where the plan has K pairs of a character (K,) and a frame (K,).

    poses: K poses in frames that travel with the characters.
    """
    headings = plan.headings[pair]
    if plan.stepping is not None:
        poses = plan.stepping.apply(pair, plan.who[pair[0]], poses)
    roots = plan.places[pair] + poses.places * floor_plane.unit_vectors(headings)
    rotations = floor_plane.turn_roots(poses.rotations, headings)
    return replace(poses, rotations=rotations, places=roots)


def _measure_strides(
    gait: Gait,
    controls: Annotated[Floats, "characters frames controls"],
    combinations: Annotated[Indices, "characters"],
) -> Strides:
    """Return the cycles of controls (N, F, d), with fields (N, F)."""
    frames = controls.shape[:2]
    labels = stride.RowLabels(gait.labels.weights, np.repeat(combinations, frames[1]))
    cycles = stride.strides(gait.session, controls.reshape(-1, controls.shape[2]), labels)
    return Strides._make(value.reshape(frames) for value in cycles)


def _increments(paces: Numbers, rate: float) -> Numbers:
    """Return the increments (N, F - 1) of rates (N, F) per second, by the trapezoidal rule."""
    return 0.5 * (paces[:, 1:] + paces[:, :-1]) / rate


def _cumulative_sums(steps: Numbers) -> Numbers:
    return np.pad(np.cumsum(steps, axis=1), ((0, 0), (1, 0)))


def _phases(cycles: Strides, first: PerCharacter, rate: float) -> CharacterFrames:
    return (first[:, None] + _cumulative_sums(_increments(1.0 / cycles.durations, rate))) % 1.0


def _distances(
    speeds: CharacterPoints, frames: int, rate: float
) -> Annotated[Floats, "characters {frames}"]:
    """Return the distances (N, F), m, along paths with speeds (N, K) at their known points."""
    arrived = _cumulative_sums(0.5 * POINT_SPACING * (1.0 / speeds[:, 1:] + 1.0 / speeds[:, :-1]))
    # One interpolation for all rows: each row's times are offset beyond those of the row before.
    offsets = np.arange(len(speeds))[:, None] * (2.0 * arrived.max())
    ways = np.tile(POINT_SPACING * np.arange(speeds.shape[1]), len(speeds))
    # A character that has arrived stays there; the gap between two rows must not be interpolated.
    when = np.minimum(np.arange(frames) / rate, arrived[:, -1:])
    return np.interp((when + offsets).ravel(), (arrived + offsets).ravel(), ways).reshape(
        -1, frames
    )


TRANSITION_SECONDS = 0.25
"""Duration of a transition between levels, s."""


@dataclass(frozen=True)
class LevelSchedule:
    """Levels of detail of N characters in F frames.

    levels: (N, F). previous: (N, F), levels before. shares: (N, F), completed share of the
    transition, 1 outside transitions.
    """

    levels: Annotated[Indices, "*frames"]
    previous: Annotated[Indices, "*frames"]
    shares: Annotated[Floats, "*frames"]

    def select(self, characters: Annotated[Indices, "chosen"]) -> "LevelSchedule":
        """Return the levels of some characters (M,)."""
        return LevelSchedule(
            self.levels[characters], self.previous[characters], self.shares[characters]
        )

    def rows(self, rows: slice) -> "LevelSchedule":
        """Return the levels of some of all frames (N F,), character by character."""
        levels, before, shares = self.levels.ravel(), self.previous.ravel(), self.shares.ravel()
        return LevelSchedule(levels[rows], before[rows], shares[rows])


def constant_schedule(level: int, shape: tuple[int, ...]) -> LevelSchedule:
    """Return one level for all characters and frames (N, F)."""
    levels = np.full(shape, level)
    return LevelSchedule(levels, levels, np.ones(shape))


def scale(
    camera: Camera, centres: Annotated[Floats, "characters frames 3"], radius: float
) -> CharacterFrames:
    """Return the pixels (N, F) that a metre covers on each character.

    centres: (N, F, 3), m. radius: of each body, m. Raises InvalidField, which names a character
    that contains the camera.
    """
    frames = range(centres.shape[1])
    columns = [
        level_selection.pixels_per_metre(camera, centres[:, frame], radius) for frame in frames
    ]
    return np.stack(columns, axis=1)


def schedule_levels(
    ladder: LevelTable, scale: CharacterFrames, limit: float, rate: float
) -> LevelSchedule:
    """Return the coarsest levels with errors of at most `limit` pixels, transitions included.

    scale: (N, F), pixels per metre. rate: frames a second. The finest level where none is within
    the limit.
    """
    switch = max(1, round(TRANSITION_SECONDS * rate))
    # Two transitions: one that has just begun ends before the next one.
    foresight = 2 * switch
    needed = _finest_ahead(_levels(ladder, scale, limit), foresight)
    spare = _finest_ahead(_levels(ladder, scale, limit * (1.0 - HYSTERESIS)), foresight)
    level, before = needed[:, 0], needed[:, 0]
    age, columns = np.full(len(level), switch), []
    for need, may in zip(needed.T, spare.T, strict=True):
        cancellation.check()
        next_level = np.where(need < level, need, np.maximum(level, may))
        next_level = np.where(age < switch, level, next_level)
        turning = next_level != level
        before, age = np.where(turning, level, before), np.where(turning, 0, age + 1)
        level = next_level
        columns.append((level, before, np.minimum((age + 1) / (switch + 1), 1.0)))
    levels, origins, shares = (np.stack(column, axis=1) for column in zip(*columns, strict=True))
    return LevelSchedule(levels, origins, quat.smoothstep(shares))


def _levels(
    ladder: LevelTable, scale: CharacterFrames, limit: float
) -> Annotated[Indices, "characters frames"]:
    return level_selection.select_by_error(ladder.errors, scale.ravel(), limit).reshape(scale.shape)


def _finest_ahead(
    levels: Annotated[Indices, "characters frames"], frames: int
) -> Annotated[Indices, "characters frames"]:
    """Return the finest level (N, F) from each frame on, over `frames` frames ahead."""
    padded = np.pad(levels, ((0, 0), (0, frames)), mode="edge")
    windows = np.lib.stride_tricks.sliding_window_view(padded, frames + 1, axis=1)
    finest: Indices = windows.min(axis=-1)
    return finest
