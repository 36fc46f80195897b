"""Paths of walks: through waypoints, to a place, and of a rate of turning over time.

A curve to a place and heading is an arc, a straight line and an arc: one of the words LSL, LSR, RSL
and RSR of L. E. Dubins, "On Curves of Minimal Length with a Constraint on Average Curvature", 1957,
with radii of their own to the left and to the right. Headings are averaged over a window, so that
the curvature changes gradually; the target is shifted until the averaged curve ends where it
should.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from posefield.common.errors import InvalidField
from posefield.common.units import Floats, PerPoint
from posefield.inference.level_selection import MAX_COORDINATE
from posefield.locomotion import floor_plane
from posefield.locomotion.floor_plane import Ends, FloorVectors
from posefield.performance.passage import FloorMotion

SPACING = 0.02
"""Largest distance between the points of a path, m. A path is an arc between two points."""
# Largest length, m, which takes hours to walk, and most waypoints, whose spline takes seconds.
MAX_LENGTH, MAX_WAYPOINTS = 10_000.0, 1_000


@dataclass(frozen=True)
class FloorPath:
    """Path over the floor.

    start: first point. headings: of the tangents (K,), rad, without jumps. spacing: between points
    along the path, m.
    """

    start: complex
    headings: PerPoint
    spacing: float

    @property
    def length(self) -> float:
        """Length, m."""
        return (len(self.headings) - 1) * self.spacing

    @property
    def distances(self) -> PerPoint:
        """Distances (K,) of the points from the start along the path, m."""
        return self.spacing * np.arange(len(self.headings), dtype=np.float64)

    @property
    def curvatures(self) -> PerPoint:
        """Curvature (K,), 1/m, positive to the left."""
        between = np.pad(np.diff(self.headings) / self.spacing, (1, 1), "edge")
        mean: Floats = 0.5 * (between[1:] + between[:-1])
        return mean

    @property
    def places(self) -> Annotated[FloorVectors, "points"]:
        """Points of the path (K,)."""
        steps = floor_plane.unit_vectors(self.headings[:-1]) * floor_plane.arc_displacement(
            np.array(self.spacing), np.diff(self.headings)
        )
        return self.start + np.pad(np.cumsum(steps), (1, 0))

    @property
    def end(self) -> complex:
        """Last point."""
        return complex(self.places[-1])

    def at(
        self, gone: Annotated[Floats, "frames"]
    ) -> tuple[Annotated[FloorVectors, "frames"], Annotated[Floats, "frames"]]:
        """Return points (F,) and headings (F,), rad, of the tangents after (F,) metres."""
        before = np.clip((gone / self.spacing).astype(np.int64), 0, len(self.headings) - 2)
        share = gone / self.spacing - before
        turns = share * np.diff(self.headings)[before]
        first = self.headings[before]
        along = floor_plane.unit_vectors(first) * floor_plane.arc_displacement(
            self.spacing * share, turns
        )
        return self.places[before] + along, first + turns


def point_count(length: float) -> int:
    """Return the number of points of a path of a length, m."""
    return max(int(np.ceil(length / SPACING)), 2) + 1


# Window over which headings are averaged, m, and as a share of the distance where this is less.
WINDOW, WINDOW_SHARE = 0.8, 0.2
# Radii in multiples of the smallest, and the detour, as a ratio of lengths, for which a larger one
# is taken: people turn gently where there is room.
GENTLENESS, DETOUR = (8.0, 5.6, 4.0, 2.8, 2.0, 1.4, 1.0), 1.1
# Windows for what no curve with the whole one reaches, as shares of it.
SMALLER = (1.0, 0.3, 0.1)
# Longest curve that is taken for want of another one, over the shortest.
LONGEST = 1.5
# Points at which headings are averaged, iterations, and the largest miss, m.
AVERAGED, ITERATIONS, MISS = 33, 8, 1e-3
# A turn the other way by less than this is none of almost a whole turn, rad.
NO_TURN = 0.3


@dataclass(frozen=True)
class Radii:
    """Smallest radii of curves to the left and to the right, m."""

    left: float
    right: float

    @property
    def larger(self) -> float:
        """Larger one of the radii, m."""
        return max(self.left, self.right)

    def allow(self, curvatures: PerPoint) -> bool:
        """Return whether no curvature (K,), 1/m, is larger than those of the radii."""
        return bool(curvatures.max() <= 1.0 / self.left and curvatures.min() >= -1.0 / self.right)


_Word = tuple[float, float]
"""Signed radii, m, of the first and of the last arc, positive to the left; zero for no arc."""


@dataclass(frozen=True)
class _Curve:
    """Arc, line and arc: two turns, rad, the length of the line, m, and the word."""

    turns: tuple[float, float]
    line: float
    word: _Word

    @property
    def lengths(self) -> tuple[float, float, float]:
        """Lengths of the three parts, m."""
        first, last = self.turns
        return abs(first * self.word[0]), self.line, abs(last * self.word[1])


def connect(start: FloorMotion, goal: complex, heading: float | None, radii: Radii) -> FloorPath:
    """Return the path from a start to a place, with a heading there, rad, or None for any.

    Raises ValueError if there is no room for a curve of these radii.
    """
    window = min(WINDOW, WINDOW_SHARE * abs(goal - start.shift))
    shortest_curves: list[_Curve] = []
    candidates: list[_Curve] = []
    for factor in GENTLENESS:
        wider = Radii(radii.left * factor, radii.right * factor)
        curves = sorted(_curves(start, goal, heading, wider), key=lambda curve: sum(curve.lengths))
        shortest_curves, candidates = shortest_curves + curves[:1], candidates + curves
    shortest = min(sum(curve.lengths) for curve in shortest_curves)
    for curve in shortest_curves:
        if sum(curve.lengths) <= DETOUR * shortest:
            path = _averaged(start, goal, heading, curve.word, window)
            if path is not None:
                return path
    # Where averaged headings turn a short arc into its other way round, another curve has none.
    limit = LONGEST * shortest
    for share in SMALLER:
        for curve in (candidate for candidate in candidates if sum(candidate.lengths) <= limit):
            path = _averaged(start, goal, heading, curve.word, share * window)
            if path is not None:
                return path
    raise ValueError("no curve")


def _curves(
    start: FloorMotion, goal: complex, heading: float | None, radii: Radii
) -> Iterator[_Curve]:
    for first in (radii.left, -radii.right):
        for last in (0.0,) if heading is None else (radii.left, -radii.right):
            curve = _curve(start, goal, heading, (first, last))
            if curve is not None:
                yield curve


def _curve(start: FloorMotion, goal: complex, heading: float | None, word: _Word) -> _Curve | None:
    """Return the curve of a word, None if its circles have no common tangent of that kind."""
    # A circle's centre is to the left of the heading; its signed radius is negative to the right.
    begin = start.shift + 1j * word[0] * np.exp(1j * start.turn)
    end = goal if heading is None else goal + 1j * word[1] * np.exp(1j * heading)
    line_of_centres, gap = end - begin, word[1] - word[0]
    if abs(line_of_centres) < abs(gap):
        return None
    line = float(np.sqrt(abs(line_of_centres) ** 2 - gap**2))
    along = float(np.angle(line_of_centres) - np.angle(line + 1j * gap))
    first = _turn(along - start.turn, word[0])
    last = 0.0 if heading is None else _turn(heading - along, word[1])
    return _Curve((first, last), line, word)


def _turn(angle: float, radius: float) -> float:
    """Return a turn by an angle on a circle: positive to the left, less than a whole one."""
    sign = np.sign(radius)
    return float(sign * ((sign * angle + NO_TURN) % (2.0 * np.pi) - NO_TURN))


def _averaged(
    start: FloorMotion, goal: complex, heading: float | None, word: _Word, window: float
) -> FloorPath | None:
    """Return the path of a word with averaged headings; None if it does not end at the place."""
    lead = 0.5 * window
    inner = replace(start, shift=start.shift + lead * np.exp(1j * start.turn))
    aim = goal if heading is None else goal - lead * np.exp(1j * heading)
    tail = 0.0 if heading is None else lead
    for _ in range(ITERATIONS):
        curve = _curve(inner, aim, heading, word)
        if curve is None:
            return None
        path = _path(start, curve, (lead, tail), window)
        miss = goal - path.end
        if abs(miss) < 1e-9:
            break
        aim += miss
    return path if abs(miss) < MISS else None


def _path(
    start: FloorMotion, curve: _Curve, leads: tuple[float, float], window: float
) -> FloorPath:
    lengths = (leads[0], *curve.lengths, leads[1])
    first = start.turn + curve.turns[0]
    headings = (start.turn, start.turn, first, first, first + curve.turns[1])
    knots = np.pad(np.cumsum(lengths), (1, 0))
    values = np.array([*headings, headings[-1]])
    count = point_count(knots[-1])
    at = np.linspace(0.0, knots[-1], count)
    around = window * (np.arange(AVERAGED) + 0.5) / AVERAGED - 0.5 * window
    averaged = np.interp(at[:, None] + around, knots, values).mean(axis=1)
    return FloorPath(complex(start.shift), averaged, float(knots[-1]) / (count - 1))


NEAREST = 0.1
"""Smallest distance between two points of a walk, m."""
POINTS_PER_SPACING = 2


@dataclass(frozen=True)
class Destination:
    """Place to which a walk leads, the heading there, rad, or None for any, and its field."""

    field: str
    place: complex
    heading: float | None


def through(waypoints: Floats, start: FloorMotion | None, end: FloorMotion | None) -> FloorPath:
    """Return the spline through waypoints (P, 2), x and z, m.

    start: place and heading where the path begins, before the first waypoint unless they are one;
    None to begin at the first waypoint. end: place and heading at the end, after the last waypoint
    unless they are one. Raises InvalidField for unusable waypoints.
    """
    _check_waypoints(waypoints)
    points, before = waypoints, 0
    if start is not None:
        same = np.linalg.norm(points[0] - _plain(start.shift)) < NEAREST
        points, before = np.vstack([_plain(start.shift), points[int(same) :]]), int(not same)
    if end is not None:
        same = np.linalg.norm(points[-1] - _plain(end.shift)) < NEAREST
        points = np.vstack([points[:-1] if same else points, _plain(end.shift)])
    _check_gaps(points, before)
    return _spline_path(points, (_slope(start), _slope(end)))


def _spline_path(points: Annotated[Floats, "waypoints 2"], slopes: Ends) -> FloorPath:
    gone, headings = floor_plane.headings(points, SPACING, POINTS_PER_SPACING, slopes)
    count = point_count(gone[-1])
    even = np.interp(np.linspace(0.0, gone[-1], count), gone, headings)
    return FloorPath(complex(*points[0, ::-1]), even, float(gone[-1]) / (count - 1))


def to_place(start: FloorMotion, goal: Destination, radii: Radii) -> FloorPath:
    """Return the path to a place with curves of at least these radii.

    Raises InvalidField for a place too near or too far.
    """
    away = abs(goal.place - start.shift)
    if not NEAREST <= away <= MAX_LENGTH:
        raise InvalidField(
            goal.field,
            f"{away:.2f} m from where the walk begins, expected {NEAREST:g} to {MAX_LENGTH:g} m",
        )
    try:
        return connect(start, goal.place, goal.heading, radii)
    except ValueError as error:
        raise InvalidField(
            goal.field,
            f"{away:.2f} m away, with no room to turn there with radii of {radii.left:.1f} m to "
            f"the left and {radii.right:.1f} m to the right; expected a place further away",
        ) from error


def along_corners(start: FloorMotion, corners: Sequence[complex], goal: Destination) -> FloorPath:
    """Return the spline from a start along corners to a place."""
    points = np.array([_plain(point) for point in (start.shift, *corners, goal.place)])
    end = None if goal.heading is None else FloorMotion(goal.heading, goal.place)
    return _spline_path(points, (_slope(start), _slope(end)))


def turning(
    start: FloorMotion, gone: Annotated[Floats, "frames"], turns: Annotated[Floats, "frames"]
) -> FloorPath:
    """Return the path with headings `turns` (F,), rad, after distances (F,), m."""
    count = point_count(gone[-1])
    even = np.interp(np.linspace(0.0, gone[-1], count), gone, turns)
    return FloorPath(complex(start.shift), start.turn + even, float(gone[-1]) / (count - 1))


def _slope(at: FloorMotion | None) -> Annotated[Floats, "2"] | None:
    return None if at is None else _plain(np.exp(1j * at.turn))


def _plain(point: complex) -> Annotated[Floats, "2"]:
    return np.array([point.imag, point.real])


def _check_waypoints(points: Floats) -> None:
    if points.ndim != 2 or points.shape[1:] != (2,) or not np.isfinite(points).all():
        raise InvalidField("along", "expected pairs of finite numbers, x and z")
    if not 1 <= len(points) <= MAX_WAYPOINTS:
        raise InvalidField("along", f"{len(points)} points, expected 1 to {MAX_WAYPOINTS}")
    for index in np.flatnonzero((np.abs(points) > MAX_COORDINATE).any(axis=1))[:1].tolist():
        raise InvalidField(
            f"along/{index}",
            f"{np.abs(points[index]).max():g} m away, expected at most {MAX_COORDINATE:g} m",
        )


def _check_gaps(points: Floats, before: int) -> None:
    """Raise InvalidField for points too close together; `before`: points before the waypoints."""
    gaps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    if len(points) < 2:
        raise InvalidField("along", "one place, expected a path from one place to another")
    for index in np.flatnonzero(gaps < NEAREST)[:1].tolist():
        raise InvalidField(
            f"along/{index + 1 - before}",
            f"{gaps[index]:.3f} m from the one before, expected {NEAREST:g} m or more",
        )
    if gaps.sum() > MAX_LENGTH:
        raise InvalidField("along", f"{gaps.sum():.0f} m long, expected {MAX_LENGTH:g} m at most")


def nearest_waypoint(path: FloorPath, waypoints: Floats, gone: float) -> int:
    """Return the index of the waypoint (P, 2) nearest to the place after some metres."""
    point = path.at(np.array([gone]))[0][0]
    return int(np.argmin(np.abs(floor_plane.project(np.insert(waypoints, 1, 0.0, axis=1)) - point)))
