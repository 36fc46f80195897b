"""The experimental variogram of reduced motions and its fit: diagnostic and first guess.

The dissimilarity of two motions is the distance between their slices of the core tensor, which
equals that of their rows z of the sample basis scaled by the singular values. With a drift it is
taken on what least squares leaves over: a trend in the data would otherwise pass for range.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from model_export import kriging
from model_export.covariance import COVARIANCES
from service.motion.conventions import Floats

LAGS = 15
# Lags go up to this share of the largest distance, where pairs are still many.
FAR = 0.7
FEWEST_PAIRS = 3
RANGES = np.geomspace(0.2, 8.0, 40)


@dataclass(frozen=True)
class Experimental:
    """Mean distance, semivariance and number of pairs of each lag (L,)."""

    distances: Floats
    values: Floats
    pairs: Floats


@dataclass(frozen=True)
class Fit:
    """nugget, sill (of what rises above the nugget) and practical range of an isotropic model."""

    nugget: float
    sill: float
    range: float


def residuals(samples: Floats, values: Floats, drift: int) -> Floats:
    """What the drift leaves of values (n, m) at samples (n, d) by ordinary least squares."""
    functions = kriging.drift(samples, samples.shape[1], drift)
    coefficients, *_ = np.linalg.lstsq(functions, values, rcond=None)
    return values - functions @ coefficients


def lags(samples: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Pairs of samples (n, d) by lag: indices of both, their distances, and their lag."""
    first, second = np.triu_indices(len(samples), k=1)
    distances = np.linalg.norm(samples[first] - samples[second], axis=1)
    edges = np.linspace(0.0, FAR * distances.max(), LAGS + 1)
    lag = np.searchsorted(edges, distances, side="left") - 1
    near = (lag >= 0) & (lag < LAGS)
    return first[near], second[near], distances[near], lag[near]


def experimental(samples: Floats, values: Floats) -> Experimental:
    """Matheron's estimator over lags with enough pairs."""
    first, second, distances, lag = lags(samples)
    halves = 0.5 * np.sum(np.square(values[first] - values[second]), axis=1)
    pairs = np.bincount(lag, minlength=LAGS)
    enough = pairs >= FEWEST_PAIRS
    return Experimental(
        (np.bincount(lag, distances, LAGS)[enough] / pairs[enough]),
        (np.bincount(lag, halves, LAGS)[enough] / pairs[enough]),
        pairs[enough].astype(np.float64),
    )


def fit(experimental: Experimental, covariance: str) -> Fit:
    """Weighted least squares with Cressie's weights N / γ² (1985), over a grid of ranges.

    Nugget and sill enter linearly, so that for each range they are solved for and not searched.
    Where no lag has pairs enough, as with a control of two values, nothing is known: no sill.
    """
    if not len(experimental.pairs):
        return Fit(0.0, 0.0, float(RANGES[-1]))
    squared = np.square(experimental.distances[None] / RANGES[:, None])
    rising = 1.0 - COVARIANCES[covariance].numpy(squared)
    weights = experimental.pairs / np.maximum(experimental.values, 1e-30) ** 2
    nuggets, sills = _lines(rising, experimental.values, weights)
    misfit = (nuggets[:, None] + sills[:, None] * rising - experimental.values) ** 2 @ weights
    best = int(np.argmin(misfit))
    return Fit(float(nuggets[best]), float(sills[best]), float(RANGES[best]))


def _lines(rising: Floats, values: Floats, weights: Floats) -> tuple[Floats, Floats]:
    """Intercepts and slopes (R,), none below zero, of values (L,) over rising (R, L)."""
    mean_x, mean_y = rising @ weights / weights.sum(), values @ weights / weights.sum()
    spread = (rising - mean_x[:, None]) ** 2 @ weights
    slopes = ((rising - mean_x[:, None]) * (values - mean_y)) @ weights / np.maximum(spread, 1e-30)
    through_zero = (rising * values) @ weights / np.maximum(rising**2 @ weights, 1e-30)
    slopes = np.maximum(slopes, 0.0)
    nuggets = mean_y - slopes * mean_x
    slopes = np.where(nuggets < 0.0, through_zero, slopes)
    return np.maximum(nuggets, 0.0), slopes


def fit_by_search(experimental: Experimental, covariance: str) -> Fit:
    """The same least squares by a general solver over nugget, sill and range at once.

    It is how such fits are commonly made, and what the naive method is timed with.
    """
    top, far = float(experimental.values.max()), float(experimental.distances.max())
    roots = np.sqrt(experimental.pairs) / np.maximum(experimental.values, 1e-30)

    def misfit(x: Floats) -> Floats:
        squared = np.square(experimental.distances / x[2])
        return roots * (
            x[0] + x[1] * (1.0 - COVARIANCES[covariance].numpy(squared)) - experimental.values
        )

    low, high = [0.0, 0.0, RANGES[0]], [2.0 * top, 10.0 * top, RANGES[-1]]
    found = least_squares(
        misfit, [0.1 * top, 0.9 * top, 0.5 * far], bounds=(low, high), x_scale=[top, top, far]
    )
    return Fit(*map(float, found.x))
