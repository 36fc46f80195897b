"""Paths from given routes: waypoints and a speed."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from posefield.common.array_shapes import PerPoint
from posefield.common.errors import InvalidField
from posefield.common.units import Floats
from posefield.inference.level_selection import MAX_COORDINATE
from posefield.locomotion import floor_splines
from posefield.locomotion.gait import Gait
from posefield.locomotion.paths import POINT_SPACING, Paths

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
    places = max(len(headings) for headings, _ in curves) + 1
    # Padding beyond the end of a path is not walked.
    rows = [np.pad(headings, (0, places - len(headings)), "edge") for headings, _ in curves]
    paths = Paths(
        np.array([complex(*route.waypoints[0, ::-1]) for route in routes]),
        np.stack(rows),
        np.tile([[route.speed] for route in routes], places).astype(np.float64),
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
    gone, headings = floor_splines.headings(waypoints, POINT_SPACING, POINTS_PER_STEP, natural)
    along = np.arange(int(gone[-1] / POINT_SPACING) + 1) * POINT_SPACING
    return np.interp(along, gone, headings), float(gone[-1])


def _check_turning(gait: Gait, paths: Paths) -> None:
    turning = paths.speeds * paths.curvatures
    walked = POINT_SPACING * np.arange(turning.shape[1]) <= paths.lengths[:, None]
    sharp = walked & ~gait.region.contains(paths.speeds, turning)
    for index in np.flatnonzero(sharp.any(axis=1))[:1]:
        at = int(np.argmax(np.where(sharp[index], np.abs(turning[index]), -1.0)))
        place, speed = paths.places[index, at], paths.speeds[index, at]
        low, high = gait.region.turning(np.array(speed))
        raise InvalidField(
            f"paths/{index}",
            f"at x {place.imag:.2f} m, z {place.real:.2f} m it turns by {turning[index, at]:.3f} "
            f"rad/s, expected {low:.3f} to {high:.3f} rad/s at {speed:g} m/s; positive is left",
        )
