"""Grid over the controls: its points, linear interpolation between them, and its refinement."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise, product
from typing import Annotated

import numpy as np

from posefield.common.array_shapes import PointControls
from posefield.common.units import Floats, Indices
from posefield.model_file.answer_bounds import AnswerBounds

IntervalError = Callable[[int, float, float], float]
"""Error of interpolation in the middle of an interval: axis, lower end and upper end."""


@dataclass(frozen=True)
class ControlGrid:
    """Increasing values of each control; every combination is a point, the last control fastest."""

    axes: tuple[Annotated[Floats, "_"], ...]

    def __len__(self) -> int:
        return int(np.prod(self.shape))

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of values of each control."""
        return tuple(len(axis) for axis in self.axes)

    @property
    def points(self) -> PointControls:
        """Points (B, d)."""
        return np.stack([axis.ravel() for axis in np.meshgrid(*self.axes, indexing="ij")], axis=1)

    def corners(
        self, points: PointControls
    ) -> tuple[Annotated[Indices, "points corners"], Annotated[Floats, "points corners"]]:
        """Return the indices of the grid's points around points (B, d), and their weights.

        Multilinear interpolation: the weights of a point sum to one.
        """
        cells, shares = zip(*map(_interval, self.axes, points.T), strict=True)
        indices, weights = [], []
        for corner in product((0, 1), repeat=len(self.axes)):
            at = [cell + upper for cell, upper in zip(cells, corner, strict=True)]
            indices.append(np.ravel_multi_index(at, self.shape))
            parts = [s if upper else 1.0 - s for s, upper in zip(shares, corner, strict=True)]
            weights.append(np.prod(parts, axis=0))
        return np.stack(indices, axis=1), np.stack(weights, axis=1)


def _interval(
    axis: Annotated[Floats, "_"], values: Annotated[Floats, "points"]
) -> tuple[Annotated[Indices, "points"], Annotated[Floats, "points"]]:
    """Return the interval of an axis that holds each value, and the share of it that lies below."""
    at = np.clip(np.searchsorted(axis, values, side="right") - 1, 0, len(axis) - 2)
    return at, (values - axis[at]) / (axis[at + 1] - axis[at])


def even(bounds: AnswerBounds, count: int) -> ControlGrid:
    """Return a grid of `count` even steps of each control between its limits."""
    ends = zip(*bounds.limits, strict=True)
    return ControlGrid(tuple(np.linspace(*pair, count) for pair in ends))


def refined(bounds: AnswerBounds, error: IntervalError, tolerance: float, most: int) -> ControlGrid:
    """Return a grid that is halved where its error is largest.

    It ends where each error is at most the tolerance, or where another value would make it larger
    than `most` points. The first grid has the limits and the ends of the sampled ranges, where
    answers begin to be bounded.
    """
    ends = zip(bounds.limits[0], bounds.low, bounds.high, bounds.limits[1], strict=True)
    axes = [list(map(float, values)) for values in ends]
    errors = [[error(i, *pair) for pair in _pairs(axis)] for i, axis in enumerate(axes)]
    while True:
        worst, i, k = max((e, i, k) for i, own in enumerate(errors) for k, e in enumerate(own))
        size = np.prod([len(axis) + (j == i) for j, axis in enumerate(axes)])
        if worst <= tolerance or size > most:
            return ControlGrid(tuple(np.array(axis) for axis in axes))
        low, high = axes[i][k : k + 2]
        middle = 0.5 * (low + high)
        axes[i].insert(k + 1, middle)
        errors[i][k : k + 1] = [error(i, low, middle), error(i, middle, high)]


def _pairs(axis: list[float]) -> list[tuple[float, float]]:
    return list(pairwise(axis))
