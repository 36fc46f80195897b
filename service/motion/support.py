"""Whether anything like some controls was captured, by the controls of the captured clips alone.

Sigma says how far a captured clip would lie from an answer, and where it believes in a straight
line it believes in it far beyond the clips and between clusters of them. This asks what is near,
and nothing of the motion: how far beyond the range of a control a query lies, and the variance of a
plain field over the controls, which sees gaps.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from service.motion.conventions import Floats, Singles, Truths
from service.motion.field import half_ranges

BEYOND = 0.1
"""Share of a control's range by which a query may lie beyond it."""
QUANTILE = 0.95
"""Of the captured clips, each left out: so many lie within the limit of the variance."""
# The plain field: standard deviation of its covariance in half-ranges, and its nugget in sills.
SCALE, NUGGET = 1.0, 0.05
RATE = 0.5 / SCALE**2
# What single precision may be off by where it says how much is explained.
DOUBT = 1e-3
# More rows at a time leave a core's cache between one step and the next.
BATCH = 512


@dataclass(frozen=True)
class Support:
    """What was captured: samples (n, d) in half-ranges, and the range, low and high (d,), that they
    fill. Points are in the controls' own units."""

    low: Floats
    high: Floats
    samples: Floats

    def beyond(self, points: Floats) -> Floats:
        """How far points (B, d) lie beyond the range of each control (B, d), as shares of it."""
        return np.maximum(0.5 * (np.abs(self.scaled(points)) - 1.0), 0.0)

    def variance(self, points: Floats) -> Floats:
        """Variance (B,) of the plain field at points (B, d): from 0 where much was captured to 1
        where nothing was."""
        near = covariances(self.scaled(points), self.samples)
        return 1.0 - np.sum(near @ self._inverse * near, axis=1)

    def holds(self, points: Floats) -> Truths:
        """Whether something like each of the points (B, d) was captured."""
        low, high = np.transpose(self._box)
        inside = ((low <= points) & (points <= high)).all(axis=1)
        found = np.zeros(len(points), dtype=bool)
        own = points[inside]
        room = self.limit - self._roughly(own)
        close = np.abs(room) < DOUBT
        room[close] = self.limit - self.variance(own[close])
        found[inside] = room >= 0.0
        return found

    def held(self, point: Sequence[float]) -> bool:
        """Whether something like a point (d,) was captured: `holds`, for one at a time."""
        if not all(a <= x <= b for x, (a, b) in zip(point, self._box, strict=True)):
            return False
        slopes, offsets = self._exponents
        near = np.exp(slopes @ np.array(point) + offsets)
        squared = sum((x * f - o) ** 2 for x, (f, o) in zip(point, self._scale, strict=True))
        explained = math.exp(-2.0 * RATE * squared) * float(near @ (self._inverse @ near))
        return 1.0 - explained <= self.limit

    @cached_property
    def left_out(self) -> Floats:
        """Variance (n,) at each sample without it."""
        return 1.0 / np.diagonal(self._inverse) - NUGGET

    @cached_property
    def limit(self) -> float:
        """Largest variance at which something like a point was captured."""
        return float(np.quantile(self.left_out, QUANTILE))

    @cached_property
    def _inverse(self) -> Floats:
        own = covariances(self.samples, self.samples) + NUGGET * np.eye(len(self.samples))
        return np.asarray(np.linalg.inv(own))

    @cached_property
    def _box(self) -> list[tuple[float, float]]:
        room = BEYOND * (self.high - self.low)
        return list(zip((self.low - room).tolist(), (self.high + room).tolist(), strict=True))

    @cached_property
    def _scale(self) -> list[tuple[float, float]]:
        """For each control the factor and the offset that make half-ranges of it."""
        width = self.high - self.low
        ends = (2.0 / width).tolist(), ((self.low + self.high) / width).tolist()
        return list(zip(*ends, strict=True))

    @cached_property
    def _exponents(self) -> tuple[Floats, Floats]:
        """Slopes (n, d) and offsets (n,): the logarithm of a covariance of a point, but for what
        hangs on the point alone."""
        factors, offsets = np.transpose(self._scale)
        slopes = 2.0 * RATE * self.samples
        own = RATE * np.sum(np.square(self.samples), axis=1)
        return slopes * factors, -slopes @ offsets - own

    @cached_property
    def _single(self) -> tuple[Singles, Singles, Singles]:
        """Slopes (d, n) and offsets (n,) of exponents, and the inverse (n, n), all rounded."""
        own = RATE * np.sum(np.square(self.samples), axis=1)
        parts = (2.0 * RATE * self.samples.T, -own, self._inverse)
        slopes, offsets, inverse = (np.ascontiguousarray(part, dtype=np.float32) for part in parts)
        return slopes, offsets, inverse

    def _roughly(self, points: Floats) -> Floats:
        """`variance` (B,) in single precision, of points that are not far away."""
        slopes, offsets, inverse = self._single
        scaled = self.scaled(points).astype(np.float32)
        found = np.empty(len(points))
        for rows in (slice(at, at + BATCH) for at in range(0, len(points), BATCH)):
            own = scaled[rows]
            near = own @ slopes
            near += offsets - np.float32(RATE) * np.sum(np.square(own), axis=1)[:, None]
            np.exp(near, out=near)
            found[rows] = 1.0 - np.einsum("bi,bi->b", near @ inverse, near)
        return found

    def scaled(self, points: Floats) -> Floats:
        """Points (B, d) in half-ranges."""
        return half_ranges(points, self.low, self.high)


def of(controls: Floats) -> Support:
    """Support of captured clips' controls (n, d), each with a range."""
    low, high = controls.min(axis=0), controls.max(axis=0)
    return Support(low, high, half_ranges(controls, low, high))


def covariances(a: Floats, b: Floats) -> Floats:
    """Covariance (A, B) of the plain field between points (A, d) and (B, d) in half-ranges."""
    gaps = a[:, None] - b
    return np.asarray(np.exp(-RATE * np.sum(np.square(gaps), axis=-1)))
