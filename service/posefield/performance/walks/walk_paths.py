"""Paths of walks: through waypoints, to a place, and of a rate of turning over time."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from posefield.common.errors import InvalidField
from posefield.common.units import Floats
from posefield.inference.level_selection import MAX_COORDINATE
from posefield.locomotion import floor_plane, floor_splines
from posefield.locomotion.floor_splines import Ends
from posefield.locomotion.routes import MAX_LENGTH, MAX_WAYPOINTS
from posefield.performance.passages.passage import FloorMotion
from posefield.performance.walks import turning_curves
from posefield.performance.walks.floor_path import SPACING, FloorPath, point_count
from posefield.performance.walks.turning_curves import Radii

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
    gone, headings = floor_splines.headings(points, SPACING, POINTS_PER_SPACING, slopes)
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
        return turning_curves.connect(start, goal.place, goal.heading, radii)
    except ValueError as error:
        raise InvalidField(
            goal.field,
            f"{away:.2f} m away, with no room to turn there with radii of {radii.left:.1f} m to "
            f"the left and {radii.right:.1f} m to the right; expected a place further away",
        ) from error


def along_corners(start: FloorMotion, corners: Sequence[complex], goal: Destination) -> FloorPath:
    """Return the spline from a start along corners to a place."""
    points = np.array([_plain(each) for each in (start.shift, *corners, goal.place)])
    end = None if goal.heading is None else FloorMotion(goal.heading, goal.place)
    return _spline_path(points, (_slope(start), _slope(end)))


def turning(
    start: FloorMotion, gone: Annotated[Floats, "frames"], turns: Annotated[Floats, "frames"]
) -> FloorPath:
    """Return the path with headings `turns` (F,), rad, after distances (F,), m."""
    count = point_count(gone[-1])
    even = np.interp(np.linspace(0.0, gone[-1], count), gone, turns)
    return FloorPath(complex(start.shift), start.turn + even, float(gone[-1]) / (count - 1))


def place_of(point: Annotated[Floats, "2"]) -> complex:
    """Return the place of a point x, z, m."""
    return complex(point[1], point[0])


def _slope(at: FloorMotion | None) -> Annotated[Floats, "2"] | None:
    return None if at is None else _plain(np.exp(1j * at.turn))


def _plain(place: complex) -> Annotated[Floats, "2"]:
    return np.array([place.imag, place.real])


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
    place = path.at(np.array([gone]))[0][0]
    return int(np.argmin(np.abs(floor_plane.project(np.insert(waypoints, 1, 0.0, axis=1)) - place)))
