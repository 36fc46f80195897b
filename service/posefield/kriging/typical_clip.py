"""Typical captured clips: the medoid of all, or of those near given values.

A mean of several clusters of clips lies between them, where nothing was captured: half a squat is
the mean of sitting and standing. A medoid is a captured clip.
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from posefield.common.units import Floats, Indices, PerClip, Values

NEAR = 0.25
"""Standard deviation of the weights of clips near given values, in half-ranges."""
CANDIDATE_COST = 1.0
"""A clip is a candidate if its squared distance from the given values, in `NEAR`, exceeds the least
one by no more.
"""
NEIGHBOUR_QUANTILE = 0.95
"""Share of the captured clips whose nearest neighbour is within the radius of a neighbourhood."""
BISECTIONS = 30


def medoid(points: Annotated[Floats, "clips values"]) -> int:
    """Return the row of places (n, k) with the least sum of distances to all rows."""
    return typical_row(points, np.zeros(len(points)))


def typical_row(points: Annotated[Floats, "clips values"], costs: PerClip) -> int:
    """Return the medoid of the rows near given values.

    points (n, k): rows in the space of the open values. costs (n,): squared distances from the
    given values, in `NEAR`. Rows weigh exp(-cost / 2), and only the nearest ones are candidates.
    """
    beyond = costs - costs.min()
    distances = np.linalg.norm(points[:, None] - points, axis=-1)
    # Products of one matrix and a vector would round differently between processors.
    total = np.sum(np.exp(-0.5 * beyond)[:, None] * distances, axis=0)
    total[beyond > CANDIDATE_COST] = np.inf
    return int(np.argmin(total))


@dataclass(frozen=True)
class Neighbourhood:
    """Surroundings of captured clips in the space of open values.

    points (n, k): of the clips. sets: columns in which a point has to be near a clip, each with the
    radius of that.
    """

    points: Annotated[Floats, "clips values"]
    sets: tuple[tuple[Indices, float], ...]

    def contains(self, point: Values) -> bool:
        """Return whether a point (k,) is near a captured clip, jointly and in each value."""
        differences = self.points - point
        return all(
            np.linalg.norm(differences[:, columns], axis=1).min() <= radius
            for columns, radius in self.sets
        )

    def pull_in(self, start: Values, end: Values) -> Values:
        """Return the point farthest from a clip `start` (k,) on the way to `end` (k,) inside."""
        if self.contains(end):
            return end
        low, high = 0.0, 1.0
        for _ in range(BISECTIONS):
            middle = 0.5 * (low + high)
            inside = self.contains(start + middle * (end - start))
            low, high = (middle, high) if inside else (low, middle)
        return start + low * (end - start)


def neighbourhood(points: Annotated[Floats, "clips values"]) -> Neighbourhood:
    """Return the surroundings of captured clips at points (n, k)."""
    width = points.shape[1]
    columns = [np.arange(width), *(np.array([i]) for i in range(width if width > 1 else 0))]
    return Neighbourhood(points, tuple((column, _radius(points[:, column])) for column in columns))


def _radius(points: Floats) -> float:
    """Return the distance within which most rows (n, k) have another row."""
    distinct = np.unique(points, axis=0)
    if len(distinct) < 2:
        return 0.0
    distances = np.linalg.norm(distinct[:, None] - distinct, axis=-1)
    np.fill_diagonal(distances, np.inf)
    return float(np.quantile(distances.min(axis=1), NEIGHBOUR_QUANTILE))
