"""Paths on the floor that characters follow: through given waypoints, or at random.

The random numbers of a character are one row of a table that is generated row by row: they depend
on the seed and the character's index, not on the size of the crowd. Characters on random paths keep
their distances.
"""

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from posefield.common.errors import InvalidField
from posefield.common.units import (
    CharacterFrames,
    CharacterPoints,
    Floats,
    Indices,
    PerCharacter,
)
from posefield.inference.level_selection import MAX_COORDINATE
from posefield.locomotion import collision_avoidance, floor_plane, stride
from posefield.locomotion.collision_avoidance import SPEED_MARGIN, STEP, RandomWalks
from posefield.locomotion.floor_plane import FloorVectors
from posefield.locomotion.gait import Gait
from posefield.motion.clip import Placement

# Distance between known points of a path, m. Heading is linear between them.
POINT_SPACING = 0.1


@dataclass(frozen=True)
class Paths:
    """N paths, each known at K points that lie STEP apart along it.

    starts: (N,), first points. headings: (N, K), rad, of the tangents, without jumps; between two
    points a path is an arc. speeds: (N, K), m/s. lengths: (N,), m.
    """

    starts: Annotated[FloorVectors, "characters"]
    headings: CharacterPoints
    speeds: CharacterPoints
    lengths: PerCharacter

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


# Largest length, m, which takes hours to walk, and most waypoints, whose spline takes seconds.
MAX_LENGTH, MAX_WAYPOINTS = 10_000.0, 1_000


@dataclass(frozen=True)
class Route:
    """Waypoints (P, 2) in order, x to the left and z forward, m, and one speed, m/s."""

    waypoints: Floats
    speed: float


def parse_routes(plain: Any) -> list[Route]:
    """Return the routes of [{"waypoints": [[x, z], ...], "speed": v}, ...].

    Raises InvalidField for malformed values.
    """
    if not isinstance(plain, list) or not plain:
        raise InvalidField("paths", "expected a list of one or more routes")
    return [_parse_route(f"paths/{index}", entry) for index, entry in enumerate(plain)]


def _parse_route(field: str, entry: Any) -> Route:
    if not isinstance(entry, dict) or set(entry) != {"waypoints", "speed"}:
        raise InvalidField(field, "expected an object of waypoints and speed")
    try:
        waypoints = np.array(entry["waypoints"])
        if waypoints.dtype.kind not in "if" or isinstance(entry["speed"], str | bool):
            raise ValueError(waypoints.dtype)
        return Route(waypoints.astype(float), float(entry["speed"]))
    except (TypeError, ValueError) as fault:
        raise InvalidField(field, "expected pairs of numbers and a number") from fault


def check_route(gait: Gait, index: int, route: Route) -> None:
    """Raise InvalidField, with its number, for a route that no walker of the gait can follow."""
    points, (low, high) = route.waypoints, gait.region.speeds
    field = f"paths/{index}/waypoints"
    if points.ndim != 2 or points.shape[1] != 2 or len(points) < 2 or not np.isfinite(points).all():
        raise InvalidField(
            field, f"numbers {points.shape}, expected two or more pairs of finite ones"
        )
    if len(points) > MAX_WAYPOINTS or not (np.abs(points) <= MAX_COORDINATE).all():
        raise InvalidField(
            field,
            f"{len(points)} up to {np.abs(points).max():g} m away, expected at most "
            f"{MAX_WAYPOINTS} up to {MAX_COORDINATE:g} m",
        )
    length = float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
    if length > MAX_LENGTH:
        raise InvalidField(field, f"{length:.0f} m from one to the last, expected {MAX_LENGTH:g} m")
    if not low <= route.speed <= high:
        raise InvalidField(
            f"paths/{index}/speed", f"{route.speed:g} m/s, expected {low:.3g} to {high:.3g} m/s"
        )
    short = np.linalg.norm(np.diff(points, axis=0), axis=1) < POINT_SPACING
    if short.any():
        at = int(np.argmax(short))
        raise InvalidField(
            f"paths/{index}/waypoints/{at + 1}",
            f"less than {POINT_SPACING:g} m from the one before, expected a way to it",
        )


# Spacing of the initial grid, and largest offset of a character from its grid point, m.
SPACING, MAX_JITTER = 2.0, 0.5
# Phases of neighbours on the grid in each direction, and their largest variation: any of the eight
# neighbours differ by at least a tenth of a cycle.
PHASE_STEPS, PHASE_VARIATION = (0.4, 0.2), 0.1
# Rings of the grid around a crowd whose starts are kept free.
RINGS = 2
# Wavelengths, m, and weights of the variation of turning and speed along a path.
WAVELENGTHS, WAVE_WEIGHTS = np.array([23.0, 11.0, 6.1]), np.array([0.5, 0.3, 0.2])
# Share of the sampled turning that is used, and relative variation of the speed.
TURNING_SHARE, SPEED_VARIATION = 0.8, 0.15


@dataclass(frozen=True)
class Characters:
    """Performers, phases and random numbers of N characters.

    who: (N,), labels by index in `stride.label_rows`, -1 for a model without any. phases: (N,), of
    the cycle at the beginning. random_numbers: (N, columns), random numbers from 0 to 1 for the
    paths. later: (M,), starts of further characters of the seed, around these.
    """

    who: Annotated[Indices, "characters"]
    phases: PerCharacter
    random_numbers: Annotated[Floats, "characters columns"]
    later: Annotated[FloorVectors, "later"]


def draw_characters(gait: Gait, count: int, seed: int) -> Characters:
    """Return the characters of a seed."""
    all_rows = _random_table((int(np.ceil(np.sqrt(count))) + RINGS) ** 2, seed)
    table, (rows, columns) = all_rows[:count], grid_cells(count)
    phases = PHASE_STEPS[0] * rows + PHASE_STEPS[1] * columns + PHASE_VARIATION * table[:, 1]
    later = _starts(all_rows[:, 2:4])[count:]
    return Characters(gait.labels.draw(table[:, 0]), phases % 1.0, table[:, 2:], later)


def initial_placement(count: int, seed: int) -> Placement:
    """Return the initial positions and headings of `count` characters' paths."""
    numbers = _random_table(count, seed)[:, 2:]
    return Placement(
        floor_plane.at_height(_starts(numbers[:, :2]), np.zeros(count)), _initial_headings(numbers)
    )


def draw_paths(gait: Gait, characters: Characters, seconds: float) -> Paths:
    """Return random paths that keep their distances, long enough for `seconds`.

    Beyond them a path goes on with its last speed and curvature.
    """
    walks = _draw_walks(gait, characters, seconds)
    walks = collision_avoidance.keep_distances(gait.region, walks, characters.later)
    count = int(np.ceil(gait.region.speeds[1] * seconds / POINT_SPACING)) + 3
    along = np.linspace(0.0, (count - 1) * POINT_SPACING, count)
    gone = collision_avoidance.cumulative_integrals(walks.speeds)
    speeds, turning = (
        np.stack([np.interp(along, *pair) for pair in zip(gone, rates, strict=True)])
        for rates in (walks.speeds, walks.turning)
    )
    # Curvatures, 1/m. The trapezoidal rule: that of a step is the mean of those at its ends.
    bends = turning / speeds
    turns = np.cumsum(0.5 * POINT_SPACING * (bends[:, 1:] + bends[:, :-1]), axis=1)
    headings = walks.headings[:, None] + np.pad(turns, ((0, 0), (1, 0)))
    return Paths(walks.starts, headings, speeds, np.full(len(headings), along[-1]))


def _draw_walks(gait: Gait, characters: Characters, seconds: float) -> RandomWalks:
    """Return random walks of characters that do not know of one another."""
    numbers = characters.random_numbers
    waves = 2.0 * np.pi * numbers[:, 4:].reshape(len(numbers), 2, len(WAVELENGTHS))
    mean_speeds = _captured_speeds(gait, characters.who, numbers[:, 3])
    along = mean_speeds * STEP * np.arange(int(np.ceil(seconds / STEP)) + 2)
    speeds = _speeds(gait, mean_speeds, _wave(along, waves[:, 0]))
    low, high = gait.region.turning(speeds)
    # Straight where the wave is zero.
    turning = _vary(TURNING_SHARE * _wave(along, waves[:, 1]), low, np.zeros(1), high)
    return RandomWalks(_starts(numbers[:, :2]), _initial_headings(numbers), speeds, turning)


def _random_table(count: int, seed: int) -> Annotated[Floats, "{count} columns"]:
    return np.random.Generator(np.random.PCG64(seed)).random((count, 6 + 2 * len(WAVELENGTHS)))


def _initial_headings(
    numbers: Annotated[Floats, "characters columns"],
) -> PerCharacter:
    return 2.0 * np.pi * numbers[:, 2]


def _starts(spot: Annotated[Floats, "characters 2"]) -> Annotated[FloorVectors, "characters"]:
    """Return starts (N,), m, on a grid numbered in growing squares.

    A character's start does not depend on how many characters follow.
    """
    rows, columns = grid_cells(len(spot))
    jitter = MAX_JITTER * (2.0 * spot - 1.0)
    return (SPACING * rows + jitter[:, 0]) + 1j * (SPACING * columns + jitter[:, 1])


def grid_cells(
    count: int,
) -> tuple[Annotated[Indices, "characters"], Annotated[Indices, "characters"]]:
    """Return the rows and columns (N,) of a grid that is numbered in growing squares."""
    number = np.arange(count)
    ring = np.sqrt(number).astype(np.int64)
    on = number - ring**2
    return np.minimum(2 * ring - on, ring), np.minimum(on, ring)


def _wave(
    along: Annotated[Floats, "characters steps"], phases: Annotated[Floats, "characters waves"]
) -> Annotated[Floats, "characters steps"]:
    """Return values (N, T) from -1 to 1 that vary smoothly along (N, T) m."""
    angles = 2.0 * np.pi * along[..., None] / WAVELENGTHS + phases[:, None]
    return np.sin(angles) @ WAVE_WEIGHTS


def _captured_speeds(
    gait: Gait, combinations: Annotated[Indices, "characters"], numbers: PerCharacter
) -> Annotated[Floats, "characters 1"]:
    """Return speeds (N, 1), m/s, of captured clips, each of the character's own performer."""
    moved_by = stride.clip_performers(gait.session.card)
    order = np.argsort(moved_by, kind="stable")
    first, after = (
        np.searchsorted(moved_by[order], combinations, side) for side in ("left", "right")
    )
    clips = order[first + (numbers * (after - first)).astype(np.int64)]
    return gait.rates[clips, :1]


def _speeds(
    gait: Gait,
    mean_speeds: Annotated[Floats, "characters 1"],
    wave: CharacterPoints,
) -> CharacterPoints:
    """Return speeds (N, K), m/s, that vary about the mean ones (N, 1)."""
    captured = np.array(gait.region.speeds)
    low, high = captured + SPEED_MARGIN * (captured[::-1] - captured)
    middle = np.clip(mean_speeds, low, high)
    slower = np.maximum((1.0 - SPEED_VARIATION) * middle, low)
    faster = np.minimum((1.0 + SPEED_VARIATION) * middle, high)
    return _vary(wave, slower, middle, faster)


def _vary(wave: Floats, low: Floats, middle: Floats, high: Floats) -> Floats:
    return middle + np.where(wave < 0.0, middle - low, high - middle) * wave
