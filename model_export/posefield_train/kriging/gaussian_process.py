"""A Gaussian process with a range of its own for each control and name, by marginal likelihood.

Travel follows from the controls nearly exactly, over ranges far longer than those of the pose. The
graph computes covariances with the pose's ranges alone, so kriging interpolates what the process
says at the samples.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np
from scipy.linalg import cho_solve, cholesky
from scipy.optimize import minimize

from posefield.common.units import Floats, SampleMatrix, SampleValues
from posefield.kriging import kriging_model
from posefield_train.kriging import universal_kriging
from posefield_train.kriging.coefficient_models import FittedModel
from posefield_train.kriging.kriging_bank import ConstantModel
from posefield_train.kriging.sample_points import SamplePoints

# As scikit-learn adds to the diagonal.
JITTER = 1e-10
AMPLITUDE, LENGTH, NOISE = (1.0, 1e-3, 1e3), (1.0, 0.1, 100.0), (0.1, 1e-5, 10.0)
"""Start of the search for each kind of parameter, and its bounds."""
INTERPOLATION = 1e-3
"""Nugget at which kriging passes through the values of the process."""


@dataclass(frozen=True)
class MarginalLikelihood:
    """Marginal likelihood of values (n, m), all columns together.

    scikit-learn makes tables (n, n, m) and (n, n, d) at every step of the search; the products here
    give the same number and slope in a fraction of the time. squares: (n, n, d), of the differences
    of the points in each coordinate.
    """

    squares: Floats
    values: Floats

    def negative(
        self, theta: Annotated[Floats, "parameters"]
    ) -> tuple[float, Annotated[Floats, "parameters"]]:
        """Return minus the logarithm of the likelihood, and its slope.

        theta: logarithms of amplitude, length scales and noise, in the order of the kernel.
        """
        rates = np.exp(-2.0 * theta[1:-1])
        noise, signal = np.exp(theta[-1]), self.signal(theta)
        covariance = signal + (noise + JITTER) * np.eye(len(signal))
        try:
            factor = cholesky(covariance, lower=True, check_finite=False)
        except np.linalg.LinAlgError:
            return np.inf, np.zeros_like(theta)
        count, columns = self.values.shape
        alpha = cho_solve((factor, True), self.values, check_finite=False)
        inverse = cho_solve((factor, True), np.eye(count), check_finite=False)
        likelihood = (
            -0.5 * float(np.sum(self.values * alpha))
            - columns * float(np.log(np.diag(factor)).sum())
            - 0.5 * columns * count * np.log(2.0 * np.pi)
        )
        inner = alpha @ alpha.T - columns * inverse
        weighted = inner * signal
        lengths = np.tensordot(weighted, self.squares, axes=2) * rates
        slope = 0.5 * np.array([weighted.sum(), *lengths, noise * np.trace(inner)])
        return -likelihood, -slope

    def signal(self, theta: Annotated[Floats, "parameters"]) -> SampleMatrix:
        """Return the covariances (n, n) without noise."""
        rates = np.exp(-2.0 * theta[1:-1])
        return np.asarray(np.exp(theta[0] - 0.5 * self.squares @ rates))

    def optimize(
        self,
        unused: Callable[..., Any],
        start: Annotated[Floats, "parameters"],
        bounds: Annotated[Floats, "parameters 2"],
    ) -> tuple[Annotated[Floats, "parameters"], float]:
        """Return the best theta and its value; an optimizer of scikit-learn's regressor."""
        limits = [(float(low), float(high)) for low, high in bounds]
        best = minimize(self.negative, start, method="L-BFGS-B", jac=True, bounds=limits)
        return best.x, float(best.fun)


def smooth(samples: SamplePoints, values: SampleValues) -> tuple[SampleValues, SampleValues]:
    """Return the predictions (n, m) at the samples, and residuals (n, m) of left-out groups."""
    centre, size = values.mean(axis=0), max(float(values.std()), 1e-12)
    squares = np.square(samples.points[:, None] - samples.points)
    likelihood = MarginalLikelihood(squares, (values - centre) / size)
    starts = np.log([AMPLITUDE, *[LENGTH] * samples.points.shape[1], NOISE])
    theta, _ = likelihood.optimize(np.log, starts[:, 0], starts[:, 1:])
    signal = likelihood.signal(theta)
    inverse = np.linalg.inv(signal + np.exp(theta[-1]) * np.eye(len(signal)))
    dual = size * (inverse @ likelihood.values)
    several = kriging_model.equal_sized_groups(samples.groups)
    return centre + signal @ dual, kriging_model.divide_groups(inverse, dual, several)


def with_own_ranges(
    fitted: FittedModel, samples: SamplePoints, values: SampleValues
) -> FittedModel:
    """Return a model of values (n, m) that gives what a process says of them at the samples.

    The model is returned as it is where left-out groups are nearer to it, and for large families.
    """
    field = fitted.field
    if isinstance(field, ConstantModel) or samples.inducing is not None:
        return fitted
    smoothed, residuals = smooth(samples, values)
    before, after = (float(np.sum(np.square(one))) for one in (fitted.residuals, residuals))
    if after >= before:
        return fitted
    # The values of which the model's own nugget makes the interpolation.
    near = replace(field.hyper, nugget=INTERPOLATION)
    dual = universal_kriging.solve(near, samples.points, smoothed).dual
    moved = universal_kriging.values(field.hyper, samples.points, dual)
    solved = universal_kriging.solve(field.hyper, samples.points, moved)
    return FittedModel(solved, 1.0 - after / before * (1.0 - fitted.explained), residuals)
