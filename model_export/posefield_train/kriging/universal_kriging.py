"""Universal kriging of many values at once, in its dual form (Mukai & Kuriyama 2006, section 2).

The dual weights of the system (posefield.kriging.kriging_model) answer a query by one product; its
inverse gives the variance.

The nugget is filtered: it is on the diagonal of the system only, so that the
prediction is continuous in the controls.
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from posefield.common.errors import TrainingError
from posefield.common.units import (
    Floats,
    PerPoint,
    Points,
    PointSamples,
    PointValues,
    Samples,
    SampleValues,
)
from posefield.kriging import kriging_model
from posefield.kriging.kriging_model import Hyper as Hyper
from posefield.kriging.kriging_model import covariances as covariances
from posefield.kriging.kriging_model import drift as drift

# Shared with the service; training imports them from here.
from posefield.kriging.kriging_model import leave_out as leave_out
from posefield.kriging.kriging_model import left_out_variances as left_out_variances
from posefield.kriging.kriging_model import noisy as noisy


@dataclass(frozen=True)
class UniversalKriging:
    """A solved kriging model.

    samples: (n, d + p). dual: weights (n + k, m) of the values. weighing: (n + k, n), maps values
    to dual weights. form: quadratic form (n + k, n + k) of the variance.

    A point is d controls and p labels, one-hot for a performer and zero for an unseen performer.
    """

    hyper: Hyper
    samples: Samples
    dual: Annotated[Floats, "system values"]
    weighing: Annotated[Floats, "system samples"]
    form: Annotated[Floats, "system system"]

    def predict(self, points: Points) -> PointValues:
        """Return values (B, m) at points (B, d + p)."""
        return self._basis(points) @ self.dual

    def weights(self, points: Points) -> PointSamples:
        """Return the weight of each sample (B, n); they sum to one, and may be negative."""
        return self._basis(points) @ self.weighing

    def variance(self, points: Points) -> PerPoint:
        """Return the kriging variance (B,) of the filtered model, as a share of the sill."""
        basis, prior = self._basis(points), kriging_model.prior_variances(self.hyper, points)
        return prior - np.sum(basis @ self.form * basis, axis=1)

    @property
    def values(self) -> SampleValues:
        """Return the sample values (n, m) that the model was solved for."""
        return values(self.hyper, self.samples, self.dual)

    def _basis(self, points: Points) -> Annotated[Floats, "points system"]:
        return kriging_model.basis_functions(self.hyper, points, self.samples)


def solve(hyper: Hyper, samples: Samples, values: SampleValues) -> UniversalKriging:
    """Return the kriging model of values (n, m) at samples (n, d + p).

    `check_samples` the samples first.

    With more than one drift the weights are averaged, and the variance is that of their average.
    """
    n, functions = len(samples), 1 + max(hyper.drifts) * len(hyper.scales)
    weighing = kriging_model.weight_matrix(hyper, samples)
    toward = np.vstack([np.eye(n), np.zeros((functions, n))]) @ weighing.T
    form = toward + toward.T - weighing @ noisy(hyper, samples) @ weighing.T
    return UniversalKriging(hyper, samples, weighing @ values, weighing, form)


def values(
    hyper: Hyper, samples: Samples, dual: Annotated[Floats, "system values"]
) -> SampleValues:
    """Return the sample values (n, m) for dual weights (n + k, m): the system times the weights."""
    n, degree = len(samples), max(hyper.drifts)
    functions = drift(samples, len(hyper.scales), degree)
    return noisy(hyper, samples) @ dual[:n] + functions @ dual[n:]


def check_samples(
    samples: Annotated[Floats, "samples {len(names)}"],
    names: tuple[str, ...],
    degree: int,
    nugget_is_zero: bool,
) -> None:
    """Raise TrainingError for samples that make the kriging system singular.

    These are fewer samples than drift functions plus one, a control with a single value, linearly
    dependent controls, and, with a nugget of zero, two samples at one point.
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
    if np.linalg.matrix_rank(drift(samples, len(names), degree)) < 1 + len(names) * degree:
        raise TrainingError(f"controls {names}: one of them follows linearly from the others")
    if nugget_is_zero:
        _, first, inverse = np.unique(samples, axis=0, return_index=True, return_inverse=True)
        for row, group in enumerate(np.ravel(inverse)):
            if first[group] != row:
                raise TrainingError(
                    f"samples {first[group] + 1} and {row + 1} have equal controls: a nugget of "
                    "zero expects them to differ; allow a nugget, or leave one out"
                )
