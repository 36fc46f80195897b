"""Grid over the controls: its points, cubic interpolation between them, and its refinement."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise, permutations, product
from typing import Annotated

import numpy as np

from posefield.common.array_shapes import PointControls
from posefield.common.units import Floats, Indices
from posefield.model_file.answer_bounds import AnswerBounds

NODES = 4
"""Values of a control through which a polynomial is laid: two on each side of a point."""
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

        The weights are products of those of each control (`_nodes`); those of a point sum to one.
        """
        firsts, parts = zip(*map(_nodes, self.axes, points.T), strict=True)
        indices, weights = [], []
        for corner in product(*(range(part.shape[1]) for part in parts)):
            at = [first + node for first, node in zip(firsts, corner, strict=True)]
            indices.append(np.ravel_multi_index(at, self.shape))
            own = [part[:, node] for part, node in zip(parts, corner, strict=True)]
            weights.append(np.prod(own, axis=0))
        return np.stack(indices, axis=1), np.stack(weights, axis=1)


def _nodes(
    axis: Annotated[Floats, "_"], values: Annotated[Floats, "points"]
) -> tuple[Annotated[Indices, "points"], Annotated[Floats, "points nodes"]]:
    """Return the first of an axis's values around each point, and the weights of these values.

    Weights of Lagrange's polynomial through NODES values, or all of a shorter axis.
    """
    count = min(NODES, len(axis))
    below = np.searchsorted(axis, values, side="right") - 1
    first = np.clip(below - (count - 1) // 2, 0, len(axis) - count)
    nodes = axis[first[:, None] + np.arange(count)]
    weights = np.ones(nodes.shape)
    for i, j in permutations(range(count), 2):
        weights[:, i] *= (values - nodes[:, j]) / (nodes[:, i] - nodes[:, j])
    return first, weights


def even(bounds: AnswerBounds, count: int) -> ControlGrid:
    """Return a grid of `count` even steps of each control between its limits."""
    ends = zip(*bounds.limits, strict=True)
    return ControlGrid(tuple(np.linspace(*pair, count) for pair in ends))


def refined(bounds: AnswerBounds, error: IntervalError, tolerance: float, most: int) -> ControlGrid:
    """Return a grid that is halved where the error of linear interpolation is largest.

    It ends where each error is at most the tolerance, or where another value would make it larger
    than `most` points. The first grid has the limits and the ends of the sampled ranges, where
    answers begin to be bounded.
    """
    ends = zip(bounds.limits[0], bounds.low, bounds.high, bounds.limits[1], strict=True)
    axes = [list(map(float, values)) for values in ends]
    errors = [[error(i, *pair) for pair in pairwise(axis)] for i, axis in enumerate(axes)]
    while True:
        worst, i, k = max((e, i, k) for i, own in enumerate(errors) for k, e in enumerate(own))
        size = np.prod([len(axis) + (j == i) for j, axis in enumerate(axes)])
        if worst <= tolerance or size > most:
            return ControlGrid(tuple(np.array(axis) for axis in axes))
        low, high = axes[i][k : k + 2]
        middle = 0.5 * (low + high)
        axes[i].insert(k + 1, middle)
        errors[i][k : k + 1] = [error(i, low, middle), error(i, middle, high)]
