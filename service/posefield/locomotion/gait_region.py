"""Convex hull of the sampled speeds and rates of turning."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
import numpy.typing as npt

from posefield.common.array_shapes import Scalars
from posefield.common.units import Floats

# Tolerance for the rounding of points on an edge, m/s and rad/s.
SLACK = 1e-6


@dataclass(frozen=True)
class GaitRegion:
    """Convex region of speeds, m/s, and rates of turning, rad/s.

    normals: (E, 2) and limits: (E,); a pair is inside where normals times it are at most the
    limits. speeds: the smallest and the largest.
    """

    normals: Annotated[Floats, "edges 2"]
    limits: Annotated[Floats, "edges"]
    speeds: tuple[float, float]

    def contains(
        self, speeds: Scalars, turning: Scalars
    ) -> Annotated[npt.NDArray[np.bool_], "*batch"]:
        """Return whether pairs (...) are inside the region."""
        pairs = np.stack(np.broadcast_arrays(speeds, turning), axis=-1)
        return np.all(pairs @ self.normals.T <= self.limits + SLACK, axis=-1)

    def turning(
        self, speeds: Annotated[Floats, "*batch"]
    ) -> tuple[Annotated[Floats, "*batch"], Annotated[Floats, "*batch"]]:
        """Return the smallest and the largest rate of turning (...), rad/s, at speeds (...)."""
        right, left = self.normals[:, 1] < 0.0, self.normals[:, 1] > 0.0
        return self._edge_rates(speeds, right).max(axis=-1), self._edge_rates(speeds, left).min(
            axis=-1
        )

    def _edge_rates(
        self, speeds: Annotated[Floats, "*batch"], edges: npt.NDArray[np.bool_]
    ) -> Annotated[Floats, "*batch some"]:
        """Return the rates of turning (..., E) at which the edges lie at speeds (...)."""
        along, across = self.normals[edges].T
        return (self.limits[edges] - speeds[..., None] * along) / across


def convex_hull(pairs: Annotated[Floats, "pairs 2"]) -> GaitRegion:
    """Return the convex hull of pairs (N, 2) of speed and rate of turning."""
    corners = _corners(np.unique(pairs, axis=0))
    edges = np.roll(corners, -1, axis=0) - corners
    normals = np.column_stack([edges[:, 1], -edges[:, 0]])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    limits = np.sum(normals * corners, axis=1)
    return GaitRegion(normals, limits, (float(pairs[:, 0].min()), float(pairs[:, 0].max())))


def _corners(ordered: Annotated[Floats, "pairs 2"]) -> Annotated[Floats, "corners 2"]:
    """Return the hull's corners, counter-clockwise, of sorted points (Andrew's monotone chain)."""
    below, above = _chain(ordered), _chain(ordered[::-1])
    return np.array([*below[:-1], *above[:-1]])


def _chain(ordered: Annotated[Floats, "pairs 2"]) -> list[Annotated[Floats, "2"]]:
    chain: list[Floats] = []
    for point in ordered:
        while len(chain) > 1 and _area(chain[-2], chain[-1], point) <= 0.0:
            chain.pop()
        chain.append(point)
    return chain


def _area(a: Annotated[Floats, "2"], b: Annotated[Floats, "2"], c: Annotated[Floats, "2"]) -> float:
    return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))
