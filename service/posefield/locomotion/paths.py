"""Paths on the floor that characters follow: through given waypoints, or at random.

The random numbers of a character are one row of a table that is generated row by row: they depend
on the seed and the character's index, not on the size of the crowd or the duration.
"""

from collections.abc import Sequence
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
    PerPoint,
)
from posefield.inference.level_selection import MAX_COORDINATE
from posefield.locomotion import floor_plane, stride
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


# Points of a curve per STEP of the straight lines between its waypoints.
POINTS_PER_STEP = 10
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


def paths_through(gait: Gait, routes: Sequence[Route]) -> Paths:
    """Return the paths of routes: natural cubic splines through all waypoints.

    Curvature is continuous, and the speed is constant. Raises InvalidField, which names the route
    and the place, for a turn that is sharper than sampled at this speed, for a speed outside the
    sampled range, and for unusable waypoints.
    """
    for index, route in enumerate(routes):
        _check_route(gait, index, route)
    curves = [_headings(route.waypoints) for route in routes]
    count = max(len(headings) for headings, _ in curves) + 1
    # Padding beyond the end of a path is not walked.
    rows = [np.pad(headings, (0, count - len(headings)), "edge") for headings, _ in curves]
    paths = Paths(
        np.array([complex(*route.waypoints[0, ::-1]) for route in routes]),
        np.stack(rows),
        np.tile([[route.speed] for route in routes], count).astype(np.float64),
        np.array([length for _, length in curves]),
    )
    _check_turning(gait, paths)
    return paths


def _check_route(gait: Gait, index: int, route: Route) -> None:
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


def _headings(waypoints: Annotated[Floats, "waypoints 2"]) -> tuple[PerPoint, float]:
    """Return headings (K,), rad, at every STEP of a spline, and its length, m.

    waypoints: (P, 2), m, on the spline.
    """
    natural = (None, None)
    gone, headings = floor_plane.headings(waypoints, POINT_SPACING, POINTS_PER_STEP, natural)
    along = np.arange(int(gone[-1] / POINT_SPACING) + 1) * POINT_SPACING
    return np.interp(along, gone, headings), float(gone[-1])


def _check_turning(gait: Gait, paths: Paths) -> None:
    turning = paths.speeds * paths.curvatures
    walked = POINT_SPACING * np.arange(turning.shape[1]) <= paths.lengths[:, None]
    sharp = walked & ~gait.region.contains(paths.speeds, turning)
    for index in np.flatnonzero(sharp.any(axis=1))[:1]:
        at = int(np.argmax(np.where(sharp[index], np.abs(turning[index]), -1.0)))
        point, speed = paths.places[index, at], paths.speeds[index, at]
        low, high = gait.region.turning(np.array(speed))
        raise InvalidField(
            f"paths/{index}",
            f"at x {point.imag:.2f} m, z {point.real:.2f} m it turns by {turning[index, at]:.3f} "
            f"rad/s, expected {low:.3f} to {high:.3f} rad/s at {speed:g} m/s; positive is left",
        )


# Spacing of the initial grid, and largest offset of a character from its grid point, m.
SPACING, MAX_JITTER = 2.0, 0.5
# Wavelengths, m, and weights of the variation of turning and speed along a path.
WAVELENGTHS, WAVE_WEIGHTS = np.array([23.0, 11.0, 6.1]), np.array([0.5, 0.3, 0.2])
# Share of the sampled turning that is used, and relative variation of the speed.
TURNING_SHARE, SPEED_VARIATION = 0.8, 0.15
# Share of the sampled speeds that is left out at either end, where little turning was sampled.
SPEED_MARGIN = 0.05


@dataclass(frozen=True)
class Characters:
    """Performers, phases and random numbers of N characters.

    who: (N,), labels by index in `stride.label_rows`, -1 for a model without any. phases: (N,), of
    the cycle at the beginning. random_numbers: (N, columns), random numbers from 0 to 1 for the
    paths.
    """

    who: Annotated[Indices, "characters"]
    phases: PerCharacter
    random_numbers: Annotated[Floats, "characters columns"]


def draw_characters(gait: Gait, count: int, seed: int) -> Characters:
    """Return the characters of a seed."""
    table = _random_table(count, seed)
    return Characters(gait.labels.draw(table[:, 0]), table[:, 1], table[:, 2:])


def initial_placement(count: int, seed: int) -> Placement:
    """Return the initial positions and headings of `count` characters' paths."""
    numbers = _random_table(count, seed)[:, 2:]
    return Placement(
        floor_plane.at_height(_starts(numbers[:, :2]), np.zeros(count)), _initial_headings(numbers)
    )


def draw_paths(gait: Gait, characters: Characters, seconds: float) -> Paths:
    """Return random paths, long enough for `seconds` at the highest speed."""
    spot, pace = characters.random_numbers[:, :2], characters.random_numbers[:, 3]
    waves = 2.0 * np.pi * characters.random_numbers[:, 4:].reshape(len(spot), 2, len(WAVELENGTHS))
    count = int(np.ceil(gait.region.speeds[1] * seconds / POINT_SPACING)) + 3
    along = np.linspace(0.0, (count - 1) * POINT_SPACING, count)
    mean_speeds = _captured_speeds(gait, characters.who, pace)
    speeds = _speeds(gait, mean_speeds, _wave(along, waves[:, 0]))
    low, high = gait.region.turning(speeds)
    wave = TURNING_SHARE * _wave(along, waves[:, 1])
    # Curvatures, 1/m: straight where the wave is zero.
    bends = _vary(wave, low, np.zeros(1), high) / speeds
    # The trapezoidal rule: the curvature of a step is the mean of those at its ends.
    turns = np.cumsum(0.5 * POINT_SPACING * (bends[:, 1:] + bends[:, :-1]), axis=1)
    headings = _initial_headings(characters.random_numbers)[:, None] + np.pad(
        turns, ((0, 0), (1, 0))
    )
    return Paths(_starts(spot), headings, speeds, np.full(len(spot), along[-1]))


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
    number = np.arange(len(spot))
    ring = np.sqrt(number).astype(np.int64)
    on = number - ring**2
    columns, rows = np.minimum(on, ring), np.minimum(2 * ring - on, ring)
    jitter = MAX_JITTER * (2.0 * spot - 1.0)
    return (SPACING * rows + jitter[:, 0]) + 1j * (SPACING * columns + jitter[:, 1])


def _wave(along: PerPoint, phases: Annotated[Floats, "characters waves"]) -> CharacterPoints:
    """Return values (N, K) from -1 to 1 that vary smoothly along (K,) m."""
    angles = 2.0 * np.pi * along[:, None] / WAVELENGTHS + phases[:, None]
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
