"""Support of a query: whether clips with similar controls were captured.

Sigma extrapolates linear trends confidently, far beyond the clips and between clusters of them.
Support depends on the controls of the captured clips alone, not on the motion: on the distance of a
query beyond the range of each control, and on the kriging variance of a field over the controls
with a fixed Gaussian covariance, which detects gaps.

A mean of several clusters of clips lies between them, where nothing was captured: half a squat is
the mean of sitting and standing. So a typical clip is a medoid, a captured clip.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Any

import numpy as np

from posefield.common import cancellation
from posefield.common.units import (
    Booleans,
    Floats,
    Indices,
    PerClip,
    PerControl,
    PerPoint,
    PerSample,
    PointControls,
    SampleControls,
    SampleMatrix,
    Singles,
    Values,
)

RANGE_MARGIN = 0.1
"""Share of a control's range by which a supported query may lie beyond it."""
SUPPORT_QUANTILE = 0.95
"""Share of the captured clips whose leave-one-out variance is within the limit."""
# The field: standard deviation of its Gaussian covariance in half-ranges, and its nugget in sills.
SCALE, NUGGET = 1.0, 0.05
RATE = 0.5 / SCALE**2
# Largest error of a variance in single precision; nearer to the limit it is computed in double.
FLOAT32_ERROR = 1e-3
SMALL_SHARE = 0.02
"""Share of the nugget below which a direction of the covariances is bounded, not computed."""
# Rows whose intermediate arrays fit the cache of a core.
BATCH = 512


def half_ranges(
    controls: Annotated[Floats, "*points controls"], low: PerControl, high: PerControl
) -> Annotated[Floats, "*points controls"]:
    """Return controls (..., d) scaled so that the range from low to high (d,) is -1 to 1."""
    return (2.0 * controls - low - high) / (high - low)


@dataclass(frozen=True)
class Support:
    """Captured samples and their range; points are in the controls' own units.

    low, high (d,): range of the samples. samples (n, d): in half-ranges.
    """

    low: PerControl
    high: PerControl
    samples: SampleControls

    def beyond(self, points: PointControls) -> PointControls:
        """Return how far points lie beyond the range of each control (B, d), as shares of it."""
        return np.maximum(0.5 * (np.abs(self.scaled(points)) - 1.0), 0.0)

    def variance(self, points: PointControls) -> PerPoint:
        """Return the kriging variance (B,) at points (B, d), from 0 to 1.

        Near 0 among dense samples and near 1 far from all samples.
        """
        near = covariances(self.scaled(points), self.samples)
        return 1.0 - np.sum(near @ self._inverse * near, axis=1)

    def supported(self, points: PointControls) -> Annotated[Booleans, "points"]:
        """Return whether each of the points (B, d) is supported, as (B,)."""
        low, high = np.transpose(self._bounds)
        inside = ((low <= points) & (points <= high)).all(axis=1)
        supported = np.zeros(len(points), dtype=bool)
        inner_points = points[inside]
        lowest, highest = self.variance_bounds(inner_points)
        verdict = highest <= self.limit - FLOAT32_ERROR
        unsure = np.flatnonzero(~verdict & (lowest < self.limit + FLOAT32_ERROR))
        verdict[unsure] = self.variance(inner_points[unsure]) <= self.limit
        supported[inside] = verdict
        return supported

    def is_supported(self, point: Sequence[float]) -> bool:
        """Return whether a point (d,) is supported: `supported` for a single point."""
        if not all(a <= x <= b for x, (a, b) in zip(point, self._bounds, strict=True)):
            return False
        slopes, offsets = self._exponents
        near = np.exp(slopes @ np.array(point) + offsets)
        squared = sum((x * f - o) ** 2 for x, (f, o) in zip(point, self._scale, strict=True))
        explained = math.exp(-2.0 * RATE * squared) * float(near @ (self._inverse @ near))
        return 1.0 - explained <= self.limit

    def table(self) -> dict[str, Any]:
        """Return the numbers that `is_supported` evaluates, by name, as plain lists.

        bounds (d, 2): of supported points. slopes (n, d), offsets (n,): of the log covariance
        between samples and a point, without the point's own square. scale (d, 2): factor and offset
        to half-ranges. rate: factor of that square. inverse (n, n), limit: of the variance.
        """
        slopes, offsets = self._exponents
        return {
            "bounds": self._bounds,
            "slopes": slopes.tolist(),
            "offsets": offsets.tolist(),
            "scale": self._scale,
            "rate": RATE,
            "inverse": self._inverse.tolist(),
            "limit": self.limit,
        }

    @cached_property
    def left_out(self) -> PerSample:
        """Return the kriging variance (n,) at each sample, computed without it."""
        return 1.0 / np.diagonal(self._inverse) - NUGGET

    @cached_property
    def limit(self) -> float:
        """Return the largest variance at which a point is supported."""
        return float(np.quantile(self.left_out, SUPPORT_QUANTILE))

    @cached_property
    def _inverse(self) -> SampleMatrix:
        matrix = covariances(self.samples, self.samples) + NUGGET * np.eye(len(self.samples))
        return np.asarray(np.linalg.inv(matrix))

    @cached_property
    def _bounds(self) -> list[tuple[float, float]]:
        room = RANGE_MARGIN * (self.high - self.low)
        return list(zip((self.low - room).tolist(), (self.high + room).tolist(), strict=True))

    @cached_property
    def _scale(self) -> list[tuple[float, float]]:
        """Return the factor and the offset of each control that scale it to half-ranges."""
        width = self.high - self.low
        factors = (2.0 / width).tolist(), ((self.low + self.high) / width).tolist()
        return list(zip(*factors, strict=True))

    @cached_property
    def _exponents(self) -> tuple[SampleControls, PerSample]:
        """Return slopes (n, d) and offsets (n,) of the log covariance between samples and a point.

        The term of the point's own square is left out: `is_supported` multiplies by it once.
        """
        factors, offsets = np.transpose(self._scale)
        slopes = 2.0 * RATE * self.samples
        exponents = RATE * np.sum(np.square(self.samples), axis=1)
        return slopes * factors, -slopes @ offsets - exponents

    @cached_property
    def _float32_factors(self) -> "_VarianceFactors":
        """Return the parts of the variance in the leading directions of the covariances.

        With eigenvectors u and eigenvalues e of the covariances between samples, and covariances k
        of a point, the variance is 1 - sum (u k)² / (e + NUGGET), over all directions. Those of
        small e hardly count: sum (u k)² / e is at most 1.
        """
        sizes, vectors = np.linalg.eigh(covariances(self.samples, self.samples))
        sizes, vectors = np.maximum(sizes[::-1], 0.0), vectors[:, ::-1]
        count = max(int(np.sum(sizes > SMALL_SHARE * NUGGET)), 1)
        chosen_sizes = sizes[:count]
        exponents = RATE * np.sum(np.square(self.samples), axis=1)
        arrays = (
            2.0 * RATE * self.samples.T,
            -exponents,
            vectors[:, :count] / np.sqrt(chosen_sizes + NUGGET),
            np.stack([np.ones(count), (chosen_sizes + NUGGET) / chosen_sizes], axis=1),
        )
        next_size = float(sizes[count]) if count < len(sizes) else 0.0
        slopes, offsets, directions, sums = (
            np.ascontiguousarray(array, dtype=np.float32) for array in arrays
        )
        rest = next_size / (next_size + NUGGET)
        return _VarianceFactors(slopes, offsets, directions, sums, rest)

    def variance_bounds(self, points: PointControls) -> tuple[PerPoint, PerPoint]:
        """Return bounds (B,) of `variance`, right to FLOAT32_ERROR, for points near the range."""
        factors = self._float32_factors
        scaled = self.scaled(points).astype(np.float32)
        explained, captured = np.empty((2, len(points)))
        for rows in (slice(at, at + BATCH) for at in range(0, len(points), BATCH)):
            cancellation.check()
            some = scaled[rows]
            near = some @ factors.slopes
            near += factors.offsets
            near -= np.float32(RATE) * np.einsum("bd,bd->b", some, some)[:, None]
            np.exp(near, out=near)
            projections = near @ factors.directions
            np.square(projections, out=projections)
            explained[rows], captured[rows] = (projections @ factors.sums).T
        rest = factors.rest * np.maximum(1.0 - captured, 0.0)
        return 1.0 - explained - rest, 1.0 - explained

    def scaled(self, points: PointControls) -> PointControls:
        """Return points (B, d) in half-ranges."""
        return half_ranges(points, self.low, self.high)


@dataclass(frozen=True)
class _VarianceFactors:
    """Factors of the variance in float32, in the leading directions of the covariances.

    slopes (d, n), offsets (n,): of the log covariances between samples and a point in half-ranges.
    directions (n, r): from covariances to parts of the variance that is explained, before they are
    squared. sums (r, 2): from squares to what they explain, and to what they hold of the largest
    possible. rest: share of what is left of that, at most, that the other directions explain.
    """

    slopes: Annotated[Singles, "controls samples"]
    offsets: Annotated[Singles, "samples"]
    directions: Annotated[Singles, "samples rank"]
    sums: Annotated[Singles, "rank 2"]
    rest: float


def fit_support(controls: SampleControls) -> Support:
    """Return the support of captured clips' controls (n, d); each control must vary."""
    low, high = controls.min(axis=0), controls.max(axis=0)
    return Support(low, high, half_ranges(controls, low, high))


def covariances(
    a: Annotated[Floats, "a controls"], b: Annotated[Floats, "b controls"]
) -> Annotated[Floats, "a b"]:
    """Return the covariances (A, B) between points (A, d) and (B, d) in half-ranges."""
    gaps = a[:, None] - b
    return np.asarray(np.exp(-RATE * np.sum(np.square(gaps), axis=-1)))


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
