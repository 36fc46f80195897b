"""Kriging models of all quantities over the same samples, evaluated in one pass.

Pose coefficients, bone offsets, duration and time warp each have scales and a nugget of their own.
A quantity that the controls do not explain is constant. Coarser levels of detail use only the first
covariances, those of the pose at the most informative samples, with separate weights for all
quantities.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated

import numpy as np

from posefield.common.array_shapes import (
    PerControl,
    PerPoint,
    PointControls,
    PointLabels,
    Points,
    PointValues,
    SampleValues,
    Values,
)
from posefield.common.units import Floats
from posefield.kriging.kriging_model import half_ranges
from posefield_train.kriging import universal_kriging
from posefield_train.kriging.universal_kriging import UniversalKriging


@dataclass(frozen=True)
class ConstantModel:
    """A coefficient model (m,) that does not depend on the controls."""

    mean: Values

    def predict(self, points: Points) -> PointValues:
        """Return values (B, m) at points (B, d)."""
        return np.repeat(self.mean[None], len(points), axis=0)


CoefficientModel = UniversalKriging | ConstantModel

VARIANCE, POSE = "variance", "pose"


def width(field: CoefficientModel) -> int:
    """Return the number of values of a coefficient model."""
    return len(field.mean) if isinstance(field, ConstantModel) else field.dual.shape[1]


@dataclass(frozen=True)
class KrigingBank:
    """Coefficient models by name over controls sampled in the ranges low to high (d,).

    performers: names, in the order of their labels. sill: of the pose model, m² per joint and
    frame. coarse: weights (p + 1 + d + m, M) of each coarser level. Rows: labels, one, controls and
    the first m covariances. Columns: the logarithm of the variance, the other quantities, the
    pose's leading coefficients.
    """

    low: PerControl
    high: PerControl
    performers: tuple[str, ...]
    pose: UniversalKriging
    others: dict[str, CoefficientModel]
    sill: float
    coarse: tuple[Annotated[Floats, "rows columns"], ...] = ()

    @property
    def kriged(self) -> list[UniversalKriging]:
        """Return the models that depend on the controls, the pose's first."""
        fields = [self.pose, *self.others.values()]
        return [field for field in fields if isinstance(field, UniversalKriging)]

    @property
    def linear(self) -> int:
        """Return the number of labels, one and controls, which precede the covariances."""
        return len(self.performers) + 1 + len(self.low)

    @property
    def drift(self) -> int:
        """Return the number of controls in the drift of the variance."""
        return max(self.pose.hyper.drifts) * len(self.low)

    def columns(self, level: int) -> int:
        """Return the number of covariances of a level.

        The order is by model, the pose's first, then by sample.
        """
        whole = len(self.kriged) * len(self.pose.samples)
        return len(self.coarse[level - 1]) - self.linear if level else whole

    def samples(self, level: int) -> int:
        """Return the number of samples that a level evaluates."""
        return min(self.columns(level), len(self.pose.samples))

    def sample_values(self, name: str) -> SampleValues:
        """Return the values (n, m) that a model interpolates, or its mean in every row."""
        field = self.others[name]
        if isinstance(field, ConstantModel):
            return field.predict(self.pose.samples)
        return field.values

    def sizes(self, pose: int) -> list[int]:
        """Return the number of values of each quantity, the logarithm of the variance first.

        pose: number of pose coefficients.
        """
        return [1, *map(width, self.others.values()), pose]

    def points(self, controls: PointControls, labels: PointLabels) -> Points:
        """Return points (B, d + p): controls (B, d) in half-ranges of their samples, and labels."""
        return np.hstack([half_ranges(controls, self.low, self.high), labels])

    def numpy(self, points: Points, level: int = 0) -> dict[str, Annotated[Floats, "points _"]]:
        """Return values (B, m) of each quantity at points (B, d + p), the variance as a share."""
        if level:
            return self._thinned(points, self.coarse[level - 1])
        own = self.pose.variance(points)[:, None] + self.pose.hyper.nugget
        values = {name: field.predict(points) for name, field in self.others.items()}
        return {VARIANCE: own, **values, POSE: self.pose.predict(points)}

    def _thinned(
        self, points: Points, weights: Annotated[Floats, "rows columns"]
    ) -> dict[str, Annotated[Floats, "points _"]]:
        basis = self.basis(points, len(weights) - self.linear)
        ends = np.cumsum([0, *self.sizes(0)[:-1], weights.shape[1]])
        parts = (basis @ weights[:, start:end] for start, end in pairwise(ends))
        values = dict(zip([VARIANCE, *self.others, POSE], parts, strict=True))
        return {**values, VARIANCE: np.exp(values[VARIANCE])}

    def basis(self, points: Points, columns: int) -> Annotated[Floats, "points rows"]:
        """Return labels, one, controls and the first covariances (B, p + 1 + d + m)."""
        d, n = len(self.low), len(self.pose.samples)
        fields = self.kriged[: -(-columns // n)]
        near = [
            universal_kriging.covariances(field.hyper, points, field.samples) for field in fields
        ]
        one = np.ones((len(points), 1))
        return np.hstack([points[:, d:], one, points[:, :d], np.hstack(near)[:, :columns]])

    @property
    def precision(self) -> Annotated[Floats, "system system"]:
        """Return the variance's quadratic form (drift + n, drift + n) in controls, covariances."""
        order = self._order
        return self.pose.form[np.ix_(order, order)]

    @property
    def slope(self) -> tuple[Annotated[Floats, "system"], float]:
        """Return the linear part (drift + n,) and the constant part of the variance."""
        n, nugget = len(self.pose.samples), self.pose.hyper.nugget
        return -2.0 * self.pose.form[n, self._order], 1.0 + nugget - float(self.pose.form[n, n])

    @property
    def _order(self) -> Sequence[int]:
        # The kriging system's order is [covariances, 1, controls].
        n = len(self.pose.samples)
        return [*range(n + 1, n + 1 + self.drift), *range(n)]

    def sigma(self, variance: Annotated[Floats, "points 1"]) -> PerPoint:
        """Return the standard deviation (B,), m, of a captured clip from the prediction.

        variance: share of the sill (B, 1).
        """
        return np.sqrt(self.sill * np.maximum(variance[:, 0], 0.0))
