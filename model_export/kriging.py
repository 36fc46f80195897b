"""Universal kriging of many values at once, in its dual form.

The system is [[C + nugget I, F], [Fᵀ, 0]] with covariance C between samples and drift F; its dual
weights answer a query by one product, its inverse gives variance and leave-one-out residuals
(Dubrule, "Cross validation of kriging in a unique neighborhood", Math. Geology 1983). The nugget is
filtered: it stands on the diagonal only and not in the query, so that the answer is continuous in
the controls.
"""

from dataclasses import dataclass

import numpy as np

from model_export.covariance import COVARIANCES
from service.motion.conventions import Floats
from service.motion.errors import TrainingError


@dataclass(frozen=True)
class Hyper:
    """covariance: its name. drift: polynomial degree, 0 or 1. scales (d,): what a unit of each
    control is worth as distance (one over the range). nugget: as a share of the sill."""

    covariance: str
    drift: int
    scales: Floats
    nugget: float


@dataclass(frozen=True)
class Kriging:
    """A solved field: samples (n, d), values' dual weights (n + k, m) and inverse system."""

    hyper: Hyper
    samples: Floats
    dual: Floats
    inverse: Floats

    def predict(self, points: Floats) -> Floats:
        """Values (B, m) at points (B, d)."""
        return self._basis(points) @ self.dual

    def weights(self, points: Floats) -> Floats:
        """What each sample counts for (B, n): they add up to one, and may be negative."""
        return (self._basis(points) @ self.inverse)[:, : len(self.samples)]

    def variance(self, points: Floats) -> Floats:
        """Kriging variance (B,) of the smooth field, as a share of the sill."""
        basis = self._basis(points)
        return 1.0 - np.sum(basis @ self.inverse * basis, axis=1)

    def _basis(self, points: Floats) -> Floats:
        near = covariances(self.hyper, points, self.samples)
        return np.hstack([near, drift(points, self.hyper.drift)])


def covariances(hyper: Hyper, a: Floats, b: Floats) -> Floats:
    """Covariance (A, B) between points (A, d) and (B, d)."""
    gaps = (a[:, None] - b[None]) * hyper.scales
    return COVARIANCES[hyper.covariance].numpy(np.sum(np.square(gaps), axis=-1))


def drift(points: Floats, degree: int) -> Floats:
    """Drift functions (B, k) at points (B, d): a constant, and the controls for degree one."""
    one = np.ones((len(points), 1))
    return np.hstack([one, points]) if degree else one


def invert(hyper: Hyper, samples: Floats) -> Floats:
    """Inverse (n + k, n + k) of the kriging system."""
    f = drift(samples, hyper.drift)
    n, k = f.shape
    system = np.zeros((n + k, n + k))
    system[:n, :n] = covariances(hyper, samples, samples) + hyper.nugget * np.eye(n)
    system[:n, n:], system[n:, :n] = f, f.T
    return np.linalg.inv(system)


def solve(hyper: Hyper, samples: Floats, values: Floats) -> Kriging:
    """Field through values (n, m) at samples (n, d); `check` the samples first."""
    inverse = invert(hyper, samples)
    return Kriging(hyper, samples, inverse[:, : len(samples)] @ values, inverse)


def leave_one_out(inverse: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Residuals (n, m) and variances (n,) of each sample predicted from all the others.

    Closed form from the inverse of the whole system; the variance counts the nugget in.
    """
    block = inverse[: len(values), : len(values)]
    precision = np.diagonal(block)
    return block @ values / precision[:, None], 1.0 / precision


def check(samples: Floats, names: tuple[str, ...], degree: int, nugget_is_zero: bool) -> None:
    """Refuse samples that no field can be laid through, saying which and why.

    Raises TrainingError for fewer samples than drift functions and one, a control with a single
    value, controls of which one follows from the others, and, where nothing but a nugget could
    tell them apart, two samples at one point.
    """
    count, needed = len(samples), len(names) * degree + 2
    if count < needed:
        raise TrainingError(
            f"{count} samples, expected at least {needed} for {len(names)} controls and a drift "
            f"of degree {degree}"
        )
    for name, column in zip(names, samples.T, strict=True):
        if np.ptp(column) == 0:
            raise TrainingError(
                f"control {name!r} has the value {column[0]:g} in all {count} samples, expected "
                "at least two values; leave it out of the recipe"
            )
    if np.linalg.matrix_rank(drift(samples, degree)) < 1 + len(names) * degree:
        raise TrainingError(f"controls {names}: one of them follows linearly from the others")
    if nugget_is_zero:
        _refuse_twins(samples)


def _refuse_twins(samples: Floats) -> None:
    _, first, inverse = np.unique(samples, axis=0, return_index=True, return_inverse=True)
    for row, group in enumerate(np.ravel(inverse)):
        if first[group] != row:
            raise TrainingError(
                f"samples {first[group] + 1} and {row + 1} have equal controls: a nugget of zero "
                "expects them to differ; allow a nugget, or leave one out"
            )
