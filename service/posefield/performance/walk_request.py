"""Requested walk of a performance, its fields that exclude each other, and its obstacles.

Obstacles are discs on the floor. The shortest way around them along straight lines is found in a
visibility graph of regular polygons around the discs (Lozano-Perez and Wesley, 1979) by Dijkstra's
algorithm.
"""

import heapq
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Literal

import numpy as np
import numpy.typing as npt

from posefield.common.errors import InvalidField
from posefield.common.units import Floats
from posefield.locomotion.floor_plane import FloorVectors
from posefield.performance.passage import FloorMotion
from posefield.performance.speed_profile import COMFORTABLE, MAX_ACCELERATION, Curve, Scale
from posefield.performance.walk_paths import FloorPath
from posefield.question.motion_question import LabelValue, check_number, check_range

CORNERS = 12
"""Number of corners of the polygon around a disc."""
MAX_DISCS = 32
"""Largest number of discs among which a way is searched: 386 points."""


@dataclass(frozen=True)
class Disc:
    """Disc around x and z, m, with a radius, m, which includes half the walker's width."""

    x: float
    z: float
    radius: float


def check_clear(path: FloorPath, obstacles: Sequence[Disc]) -> None:
    """Raise InvalidField, with the place, if a path crosses a disc."""
    places = path.places if obstacles else np.zeros(0, complex)
    for index, disc in enumerate(obstacles):
        apart = np.abs(places - complex(disc.z, disc.x))
        at = int(np.argmin(apart))
        if apart[at] < disc.radius:
            raise InvalidField(
                f"obstacles/{index}",
                f"the path leads within {apart[at]:.2f} m of its centre at x {places[at].imag:.2f} "
                f"m, z {places[at].real:.2f} m, expected {disc.radius:.2f} m or more",
            )


def is_clear(path: FloorPath, obstacles: Sequence[Disc]) -> bool:
    """Return whether a path crosses no disc."""
    places = path.places
    return all(np.abs(places - complex(disc.z, disc.x)).min() >= disc.radius for disc in obstacles)


def way_around(
    start: complex, end: complex, obstacles: Sequence[Disc], clearance: float
) -> list[complex] | None:
    """Return the corners of the shortest way from one place to another, None if there is none.

    clearance: between the way and the discs, m; less where start or end are nearer to a disc.
    """
    centres = np.array([complex(disc.z, disc.x) for disc in obstacles])
    nearest = np.minimum(np.abs(centres - start), np.abs(centres - end))
    radii = np.array([disc.radius for disc in obstacles])
    grown = np.maximum(radii, np.minimum(radii + clearance, 0.95 * nearest))
    around = np.exp(2j * np.pi * np.arange(CORNERS) / CORNERS) / np.cos(np.pi / CORNERS)
    corners = (centres[:, None] + 1.001 * grown[:, None] * around).ravel()
    outside = np.all(np.abs(corners[:, None] - centres) >= grown, axis=1)
    points = np.array([start, end, *corners[outside]])
    return _shortest(points, _visible(points, centres, grown))


def _visible(
    points: Annotated[FloorVectors, "points"],
    centres: Annotated[FloorVectors, "discs"],
    radii: Annotated[Floats, "discs"],
) -> Annotated[npt.NDArray[np.bool_], "points points"]:
    """Return whether the straight lines between points (P,) cross none of the discs."""
    lines = points[None] - points[:, None]
    lengths = np.maximum(np.abs(lines), 1e-12)
    visible = np.ones(lines.shape, dtype=bool)
    for centre, radius in zip(centres, radii, strict=True):
        own = (centre - points)[:, None] * np.conj(lines / lengths)
        beside = own - np.clip(own.real, 0.0, lengths)
        visible &= np.abs(beside) >= radius
    return visible


def _shortest(
    points: Annotated[FloorVectors, "points"],
    visible: Annotated[npt.NDArray[np.bool_], "points points"],
) -> list[complex] | None:
    """Return the corners between the first and the second of the points on the shortest way."""
    found, before = {0: 0.0}, {0: 0}
    queue, done = [(0.0, 0)], set[int]()
    while queue:
        gone, here = heapq.heappop(queue)
        if here == 1:
            break
        if here in done:
            continue
        done.add(here)
        for there in np.flatnonzero(visible[here]).tolist():
            length = gone + float(abs(points[there] - points[here]))
            if length < found.get(there, np.inf):
                found[there], before[there] = length, here
                heapq.heappush(queue, (length, there))
    if 1 not in found:
        return None
    way = [before[1]]
    while way[-1] != 0:
        way.append(before[way[-1]])
    return [complex(points[place]) for place in way[-2::-1]]


Motion = Literal["rolling", "standing"]


@dataclass(frozen=True)
class WalkRequest:
    """Requested walk: exactly one of `along`, `to`, `seconds`, or `end` alone.

    along: waypoints (P, 2), x and z, m. to: point, x and z, m. arrive_heading: there, rad. seconds:
    duration, s, straight ahead or with `turn`, rad/s: a number or pairs of a time, s, and a rate.
    end: place and heading in which the walk ends; with `along` after its last waypoint. speed: m/s,
    or pairs of a distance, m, or time, s, and a speed. labels: name or weights by label set.
    controls: given controls by name. start, stop: whether the walk begins and ends in motion or
    standing. entry_speed, entry_turn: m/s and rad/s at which it begins in motion; None for those of
    the curves. acceleration: of starts, stops and from the entry speed, m/s². obstacles: discs.
    detour: whether a path to a place may lead around them; else one that crosses them is refused.
    """

    speed: Curve
    along: Floats | None = None
    to: tuple[float, float] | None = None
    seconds: float | None = None
    end: FloorMotion | None = None
    arrive_heading: float | None = None
    turn: Curve | None = None
    speed_over: Scale = "distance"
    labels: Mapping[str, LabelValue] = field(default_factory=dict)
    controls: Mapping[str, float] = field(default_factory=dict)
    start: Motion = "rolling"
    stop: Motion = "rolling"
    entry_speed: float | None = None
    entry_turn: float | None = None
    acceleration: float = COMFORTABLE
    obstacles: tuple[Disc, ...] = ()
    detour: bool = False


@dataclass(frozen=True)
class WalkNote:
    """Note on a plan: a code, the field that it is about, and a sentence."""

    code: str
    field: str
    message: str


def check_fields(request: WalkRequest) -> None:
    """Raise InvalidField for fields that exclude each other or that go only with others."""
    given = [name for name in ("along", "to", "seconds") if getattr(request, name) is not None]
    if len(given) > 1 or not (given or request.end):
        raise InvalidField(
            given[-1] if given else "along",
            f"{' and '.join(given) or 'none'} given, expected one of along, to and seconds",
        )
    if request.end and given not in ([], ["along"]):
        raise InvalidField("end", f"given with {given[0]}, expected alone or with along")
    if request.turn is not None and request.seconds is None:
        raise InvalidField("turn", "given without seconds, expected only with seconds")
    if request.entry_turn is not None and request.seconds is None:
        raise InvalidField("entry_turn", "given without seconds, expected only with seconds")
    if request.arrive_heading is not None and request.to is None:
        raise InvalidField("arrive_heading", "given without to, expected only with to")
    if request.detour and (request.along is not None or request.seconds is not None):
        raise InvalidField("detour", "given with along or seconds, expected only with to or end")
    if request.detour and len(request.obstacles) > MAX_DISCS:
        found = len(request.obstacles)
        raise InvalidField("obstacles", f"{found}, expected at most {MAX_DISCS} with a detour")
    for index, disc in enumerate(request.obstacles):
        for name in ("x", "z", "radius"):
            check_number(f"obstacles/{index}/{name}", getattr(disc, name))
        if disc.radius <= 0.0:
            raise InvalidField(
                f"obstacles/{index}/radius", f"{disc.radius:g} m, expected more than 0"
            )
    check_number("acceleration", request.acceleration)
    check_range("acceleration", request.acceleration, 0.1, MAX_ACCELERATION, "m/s²")
