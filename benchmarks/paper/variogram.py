"""Experimental variogram of reduced motions and its fit, for diagnosis.

The dissimilarity of two motions is the distance between their slices of the core tensor (Mukai &
Kuriyama 2006, section 2), which equals that of their rows of the sample basis scaled by the
singular values. With a drift it is computed on least-squares residuals, because a trend in the data
would be mistaken for a long range.
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from posefield.common.units import Floats, Indices, SampleControls, SampleValues
from posefield.kriging import kriging_model
from posefield_train.kriging.kriging_graph import COVARIANCES

LAGS = 15
# Largest lag as a share of the largest distance; farther pairs are few.
LARGEST_LAG = 0.7
FEWEST_PAIRS = 3
RANGES = np.geomspace(0.2, 8.0, 40)
# Numbers per batch of pairs: half a megabyte.
BATCH_NUMBERS = 65_536


@dataclass(frozen=True)
class ExperimentalVariogram:
    """Mean distance, semivariance and number of pairs of each lag (L,)."""

    distances: Annotated[Floats, "lags"]
    values: Annotated[Floats, "lags"]
    pairs: Annotated[Floats, "lags"]


@dataclass(frozen=True)
class VariogramModel:
    """Isotropic variogram model: nugget, partial sill above the nugget, and practical range."""

    nugget: float
    sill: float
    range: float


def residuals(samples: SampleControls, values: SampleValues, drift: int) -> SampleValues:
    """Return the residuals of values (n, m) at samples (n, d) after least squares on the drift."""
    functions = kriging_model.drift(samples, samples.shape[1], drift)
    coefficients, *_ = np.linalg.lstsq(functions, values, rcond=None)
    return values - functions @ coefficients


def pairs_by_lag(
    samples: SampleControls,
) -> tuple[
    Annotated[Indices, "pairs"],
    Annotated[Indices, "pairs"],
    Annotated[Floats, "pairs"],
    Annotated[Indices, "pairs"],
]:
    """Return pairs of samples (n, d) by lag: indices of both, their distances, and their lag."""
    first, second = np.triu_indices(len(samples), k=1)
    distances = np.linalg.norm(samples[first] - samples[second], axis=1)
    edges = np.linspace(0.0, LARGEST_LAG * distances.max(), LAGS + 1)
    lag = np.searchsorted(edges, distances, side="left") - 1
    near = (lag >= 0) & (lag < LAGS)
    return first[near], second[near], distances[near], lag[near]


def experimental_variogram(samples: SampleControls, values: SampleValues) -> ExperimentalVariogram:
    """Return Matheron's estimate over lags with enough pairs."""
    first, second, distances, lag = pairs_by_lag(samples)
    halves = 0.5 * _squared_distances(values, first, second)
    pairs = np.bincount(lag, minlength=LAGS)
    enough = pairs >= FEWEST_PAIRS
    return ExperimentalVariogram(
        (np.bincount(lag, distances, LAGS)[enough] / pairs[enough]),
        (np.bincount(lag, halves, LAGS)[enough] / pairs[enough]),
        pairs[enough].astype(np.float64),
    )


def _squared_distances(
    values: SampleValues, first: Annotated[Indices, "pairs"], second: Annotated[Indices, "pairs"]
) -> Annotated[Floats, "pairs"]:
    """Return the squared distances (P,) of pairs of rows of values (n, m).

    Pairs are taken in batches that stay in the processor's cache: the differences of all pairs
    would take as much memory as n / 2 copies of the values.
    """
    squared = np.empty(len(first))
    step = max(1, BATCH_NUMBERS // values.shape[1])
    for start in range(0, len(first), step):
        batch = slice(start, start + step)
        gaps = values[first[batch]] - values[second[batch]]
        np.sum(np.square(gaps, out=gaps), axis=1, out=squared[batch])
    return squared


def fit_by_grid(experimental: ExperimentalVariogram, covariance: str) -> VariogramModel:
    """Fit by weighted least squares with Cressie's weights N / γ² (1985), over a grid of ranges.

    Nugget and sill enter linearly and are solved for at each range. If no lag has enough pairs, as
    for a control of two values, the sill is zero.
    """
    if not len(experimental.pairs):
        return VariogramModel(0.0, 0.0, float(RANGES[-1]))
    squared = np.square(experimental.distances[None] / RANGES[:, None])
    rising = 1.0 - COVARIANCES[covariance].numpy(squared)
    weights = experimental.pairs / np.maximum(experimental.values, 1e-30) ** 2
    nuggets, sills = _nonnegative_lines(rising, experimental.values, weights)
    misfit = (nuggets[:, None] + sills[:, None] * rising - experimental.values) ** 2 @ weights
    best = int(np.argmin(misfit))
    return VariogramModel(float(nuggets[best]), float(sills[best]), float(RANGES[best]))


def _nonnegative_lines(
    rising: Annotated[Floats, "ranges lags"],
    values: Annotated[Floats, "lags"],
    weights: Annotated[Floats, "lags"],
) -> tuple[Annotated[Floats, "ranges"], Annotated[Floats, "ranges"]]:
    """Return intercepts and slopes (R,), not negative, of values (L,) over rising (R, L)."""
    mean_x, mean_y = rising @ weights / weights.sum(), values @ weights / weights.sum()
    spread = (rising - mean_x[:, None]) ** 2 @ weights
    slopes = ((rising - mean_x[:, None]) * (values - mean_y)) @ weights / np.maximum(spread, 1e-30)
    through_zero = (rising * values) @ weights / np.maximum(rising**2 @ weights, 1e-30)
    slopes = np.maximum(slopes, 0.0)
    nuggets = mean_y - slopes * mean_x
    slopes = np.where(nuggets < 0.0, through_zero, slopes)
    return np.maximum(nuggets, 0.0), slopes
