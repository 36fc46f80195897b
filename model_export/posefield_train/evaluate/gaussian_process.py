"""Gaussian process of scikit-learn with a faster, equal computation of its marginal likelihood."""

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import cho_solve, cholesky
from scipy.optimize import minimize
from sklearn.exceptions import ConvergenceWarning
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel

from posefield.common.units import Floats
from posefield_train.kriging.sample_points import SamplePoints

# As scikit-learn adds to the diagonal.
JITTER = 1e-10


def predict(samples: SamplePoints, values: Floats, queries: Floats) -> Floats:
    """Return predictions of a Gaussian process with a length scale for each control and performer.

    Length scales, amplitude and noise maximise the marginal likelihood.
    """
    centre, size = values.mean(axis=0), max(float(values.std()), 1e-12)
    lengths = np.ones(samples.points.shape[1])
    kernel = ConstantKernel(1.0, (1e-3, 1e3)) * RBF(lengths, (0.1, 100.0))
    noisy = kernel + WhiteKernel(0.1, (1e-5, 10.0))
    scaled = (values - centre) / size
    apart = np.square(samples.points[:, None] - samples.points)
    likelihood = MarginalLikelihood(apart, scaled)
    model = GaussianProcessRegressor(noisy, optimizer=likelihood.optimize, random_state=0)
    with warnings.catch_warnings():
        # A length scale at its bound is a valid result: the control has no influence, or all.
        warnings.simplefilter("ignore", ConvergenceWarning)
        predicted = model.fit(samples.points, scaled).predict(queries)
    return centre + size * predicted.reshape(len(queries), -1)


@dataclass(frozen=True)
class MarginalLikelihood:
    """Marginal likelihood of values (n, m) of the kernel above, all columns together.

    scikit-learn makes tables (n, n, m) and (n, n, d) at every step of the search; the products here
    give the same number and slope in a fraction of the time. squares: (n, n, d), of the differences
    of the points in each coordinate.
    """

    squares: Floats
    values: Floats

    def negative(self, theta: Floats) -> tuple[float, Floats]:
        """Return minus the logarithm of the likelihood, and its slope.

        theta: logarithms of amplitude, length scales and noise, in the order of the kernel.
        """
        amplitude, noise = np.exp(theta[0]), np.exp(theta[-1])
        rates = np.exp(-2.0 * theta[1:-1])
        signal = amplitude * np.exp(-0.5 * self.squares @ rates)
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

    def optimize(
        self, unused: Callable[..., Any], start: Floats, bounds: Floats
    ) -> tuple[Floats, float]:
        """Return the best theta and its value; an optimizer of scikit-learn's regressor."""
        limits = [(float(low), float(high)) for low, high in bounds]
        best = minimize(self.negative, start, method="L-BFGS-B", jac=True, bounds=limits)
        return best.x, float(best.fun)
