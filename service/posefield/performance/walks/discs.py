"""Obstacles of a walk: discs on the floor that its path must not cross, and ways around them.

The shortest way along straight lines is found in a visibility graph of regular polygons around the
discs (Lozano-Perez and Wesley, 1979) by Dijkstra's algorithm.
"""

import heapq
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
import numpy.typing as npt

from posefield.common.errors import InvalidField
from posefield.common.units import Floats
from posefield.locomotion.floor_plane import FloorVectors
from posefield.performance.walks.floor_path import FloorPath
from posefield.question.value_validation import check_number

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


def check_discs(obstacles: Sequence[Disc]) -> None:
    """Raise InvalidField for numbers that are not finite and for a radius that is not positive."""
    for index, disc in enumerate(obstacles):
        for name in ("x", "z", "radius"):
            check_number(f"obstacles/{index}/{name}", getattr(disc, name))
        if disc.radius <= 0.0:
            raise InvalidField(
                f"obstacles/{index}/radius", f"{disc.radius:g} m, expected more than 0"
            )


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
