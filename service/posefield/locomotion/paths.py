"""Paths on the floor that characters follow, with speeds."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from posefield.common.array_shapes import CharacterFrames, CharacterPoints, PerCharacter
from posefield.common.units import Floats, Indices
from posefield.locomotion import floor_plane
from posefield.locomotion.floor_plane import FloorVectors

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
