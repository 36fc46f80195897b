"""Coefficient models of the quantities besides the pose: bone offsets, duration, warp, travel."""

from dataclasses import dataclass

import numpy as np

from posefield.common.units import Floats
from posefield_train.kriging import kriging_tuning, universal_kriging, variogram
from posefield_train.kriging.kriging_bank import Constant, Field
from posefield_train.kriging.kriging_tuning import Tuned
from posefield_train.kriging.sample_points import Samples
from posefield_train.kriging.variogram import Experimental
from posefield_train.source.recipe import Kriging
from posefield_train.tensor.decoder import Proportions

# Largest error of bone offsets that a model may make, m.
SAME_BONE = 5e-4
# A Gaussian covariance is conditioned worse than Matérn's; it must reduce the error to this share.
CLEARLY = 0.95
# Standard errors by which a model of the controls must beat the constant.
SURE = 2.0


@dataclass(frozen=True)
class Fitted:
    """A fitted coefficient model.

    explained: share of the variation that it explains. residuals: leave-one-out residuals (N, m).
    """

    field: Field
    explained: float
    residuals: Floats


def chosen(settings: Kriging, samples: Samples, values: Floats) -> Tuned:
    """Return the model of values (N, m) with the first covariance, or a clearly better one.

    A covariance is clearly better if its leave-one-out error is below CLEARLY times the first's.
    """
    seen = _variograms(settings, samples, values)
    first, *others = (
        _tuned(settings, name, samples, values, seen) for name in settings.covariances
    )
    best = min(others, key=lambda field: field.unexplained, default=first)
    return best if best.unexplained < CLEARLY * first.unexplained else first


def tuned(settings: Kriging, covariance: str, samples: Samples, values: Floats) -> Tuned:
    """Return the model of values (N, m) with the drift of the least leave-one-out error."""
    return _tuned(settings, covariance, samples, values, _variograms(settings, samples, values))


def _variograms(settings: Kriging, samples: Samples, values: Floats) -> dict[int, Experimental]:
    """Return the variogram of the residuals for each degree of drift; covariances share it."""
    degrees = {max(drifts) for drifts in settings.drifts}
    return {
        degree: variogram.of_residuals(samples.half_ranges, values, degree) for degree in degrees
    }


def _tuned(
    settings: Kriging,
    covariance: str,
    samples: Samples,
    values: Floats,
    seen: dict[int, Experimental],
) -> Tuned:
    guesses = [
        kriging_tuning.first_guess(seen[max(drifts)], samples.controls, covariance, drifts)
        for drifts in settings.drifts
    ]
    found = [kriging_tuning.tune(guess, samples, values, settings.nugget) for guess in guesses]
    return min(found, key=lambda field: field.unexplained)


def fit(settings: Kriging, covariance: str, samples: Samples, values: Floats) -> Fitted:
    """Return a model of values (N, m) in the controls.

    It is their mean if the controls do not explain them.
    """
    if np.ptp(values, axis=0).max() == 0.0:
        return Fitted(Constant(values[0]), 0.0, np.zeros_like(values))
    found = tuned(settings, covariance, samples, values)
    explained = 1.0 - found.unexplained
    # Where the recipe gives a nugget, it has decided that the controls explain the samples.
    if not _sure(found, samples, values) and settings.nugget is None:
        return Fitted(Constant(values.mean(axis=0)), explained, samples.from_mean(values))
    return Fitted(
        universal_kriging.solve(found.hyper, samples.points, values), explained, found.residuals
    )


def _sure(found: Tuned, samples: Samples, values: Floats) -> bool:
    """Return True if the gain over the mean of the other samples exceeds SURE standard errors.

    Scales and nugget were chosen to maximize this gain, so that a small one can be chance.
    """
    from_mean = np.sum(np.square(samples.from_mean(values)), axis=1)
    gains = from_mean - np.sum(np.square(found.residuals), axis=1)
    return bool(gains.mean() > SURE * gains.std(ddof=1) / np.sqrt(len(gains)))


def proportions(offsets: Floats) -> tuple[Proportions, Floats]:
    """Return mean and directions of bone offsets (N, J, 3), and each clip's coefficients (N, r)."""
    mean = offsets.mean(axis=0)
    centred = (offsets - mean).reshape(len(offsets), -1)
    left, values, right = np.linalg.svd(centred, full_matrices=False)
    rank = 1
    while rank < len(values) and _worst(centred, left, values, right, rank) > SAME_BONE:
        rank += 1
    turned = signs(right[:rank])
    directions = (turned[:, None] * right[:rank]).reshape(rank, -1, 3)
    # The root has no bone; clear the rounding error of the decomposition.
    directions[:, 0] = 0.0
    return Proportions(mean, directions), left[:, :rank] * values[:rank] * turned


def signs(rows: Floats) -> Floats:
    """Return the sign (r,) of the largest entry of each row, 1 for a zero row.

    Multiplying by it makes the rows independent of the machine.
    """
    largest = np.argmax(np.round(np.abs(rows), 9), axis=1)
    return np.where(rows[np.arange(len(rows)), largest] < 0, -1.0, 1.0)


def _worst(centred: Floats, left: Floats, values: Floats, right: Floats, rank: int) -> float:
    kept = (left[:, :rank] * values[:rank]) @ right[:rank]
    return float(np.abs(centred - kept).max())
