"""Path over the floor, known by its headings at evenly spaced points."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from posefield.common.array_shapes import PerPoint
from posefield.common.units import Floats
from posefield.locomotion import floor_plane
from posefield.locomotion.floor_plane import FloorVectors

SPACING = 0.02
"""Largest distance between the points of a path, m. A path is an arc between two points."""


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
