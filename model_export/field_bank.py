"""From controls to everything that is kriged, in one evaluation.

Pose coefficients, bone offsets, duration and time warp are fields over the same samples, each with
scales and a nugget of its own. A field that the controls do not explain is its mean. Coarser levels
of detail know the first covariances alone, those of the pose with the samples that say most of it,
and have all fields of them by weights of their own.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from model_export import kriging
from model_export.kriging import Kriging
from service.motion.conventions import Floats
from service.motion.field import half_ranges


@dataclass(frozen=True)
class Constant:
    """A field (m,) that does not depend on the controls."""

    mean: Floats

    def predict(self, points: Floats) -> Floats:
        """Values (B, m) at points (B, d)."""
        return np.repeat(self.mean[None], len(points), axis=0)


Field = Kriging | Constant

VARIANCE, POSE = "variance", "pose"


def width(field: Field) -> int:
    """How many values a field has."""
    return len(field.mean) if isinstance(field, Constant) else field.dual.shape[1]


@dataclass(frozen=True)
class FieldBank:
    """Fields by name over controls whose sampled ranges are low to high (d,).

    performers: who is told apart, in the order of their labels. sill: of the pose field, m² a joint
    and frame. coarse: weights (p + 1 + d + m, M) of each coarser level, of labels, one, controls
    and the first m covariances to the logarithm of the variance, the others and the pose's leading
    coefficients.
    """

    low: Floats
    high: Floats
    performers: tuple[str, ...]
    pose: Kriging
    others: dict[str, Field]
    sill: float
    coarse: tuple[Floats, ...] = ()

    @property
    def kriged(self) -> list[Kriging]:
        """The fields that depend on the controls, the pose's first."""
        fields = [self.pose, *self.others.values()]
        return [field for field in fields if isinstance(field, Kriging)]

    @property
    def linear(self) -> int:
        """Number of labels, one and controls, which precede the covariances of a basis."""
        return len(self.performers) + 1 + len(self.low)

    @property
    def drift(self) -> int:
        """Number of controls that the variance hangs on by themselves."""
        return max(self.pose.hyper.drifts) * len(self.low)

    def columns(self, level: int) -> int:
        """How many covariances a level asks: of each field with every sample, the pose's first."""
        whole = len(self.kriged) * len(self.pose.samples)
        return len(self.coarse[level - 1]) - self.linear if level else whole

    def samples(self, level: int) -> int:
        """How many samples a level asks."""
        return min(self.columns(level), len(self.pose.samples))

    def at_samples(self, name: str) -> Floats:
        """What one of the others was laid through (n, m), or its mean everywhere."""
        field = self.others[name]
        if isinstance(field, Constant):
            return field.predict(self.pose.samples)
        return field.values

    def sizes(self, pose: int) -> list[int]:
        """How many values each field has, the variance's logarithm first, where the pose has so
        many."""
        return [1, *map(width, self.others.values()), pose]

    def points(self, controls: Floats, labels: Floats) -> Floats:
        """Points (B, d + p) of controls (B, d), whose sampled range is -1 to 1, and labels."""
        return np.hstack([half_ranges(controls, self.low, self.high), labels])

    def numpy(self, points: Floats, level: int = 0) -> dict[str, Floats]:
        """Values (B, m) of each field at points (B, d + p), and of the pose's variance, a share."""
        if level:
            return self._thinned(points, self.coarse[level - 1])
        own = self.pose.variance(points)[:, None] + self.pose.hyper.nugget
        values = {name: field.predict(points) for name, field in self.others.items()}
        return {VARIANCE: own, **values, POSE: self.pose.predict(points)}

    def _thinned(self, points: Floats, weights: Floats) -> dict[str, Floats]:
        basis = self.basis(points, len(weights) - self.linear)
        ends = np.cumsum([0, *self.sizes(0)[:-1], weights.shape[1]])
        parts = (basis @ weights[:, start:end] for start, end in pairwise(ends))
        values = dict(zip([VARIANCE, *self.others, POSE], parts, strict=True))
        return {**values, VARIANCE: np.exp(values[VARIANCE])}

    def basis(self, points: Floats, columns: int) -> Floats:
        """Labels, one, controls and the first covariances (B, p + 1 + d + m)."""
        d, n = len(self.low), len(self.pose.samples)
        fields = self.kriged[: -(-columns // n)]
        near = [kriging.covariances(field.hyper, points, field.samples) for field in fields]
        one = np.ones((len(points), 1))
        return np.hstack([points[:, d:], one, points[:, :d], np.hstack(near)[:, :columns]])

    @property
    def precision(self) -> Floats:
        """Quadratic form (drift + n, drift + n) of the variance, of controls and covariances."""
        order = self._order
        return self.pose.form[np.ix_(order, order)]

    @property
    def slope(self) -> tuple[Floats, float]:
        """What of the variance is linear (drift + n,) in the same, and what is constant."""
        n, nugget = len(self.pose.samples), self.pose.hyper.nugget
        return -2.0 * self.pose.form[n, self._order], 1.0 + nugget - float(self.pose.form[n, n])

    @property
    def _order(self) -> Sequence[int]:
        # The system's own is [covariances, 1, controls].
        n = len(self.pose.samples)
        return [*range(n + 1, n + 1 + self.drift), *range(n)]

    def sigma(self, variance: Floats) -> Floats:
        """How far a captured clip lies from the predicted one (B,), m, by the variance (B, 1)."""
        return np.sqrt(self.sill * np.maximum(variance[:, 0], 0.0))
