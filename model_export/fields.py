"""What is kriged beside the pose: bone offsets, duration, warp, travel."""

from dataclasses import dataclass

import numpy as np

from model_export import kriging, tune
from model_export.decoder import Proportions
from model_export.field_bank import Constant, Field
from model_export.recipe import Kriging
from model_export.samples import Samples
from model_export.tune import Tuned
from service.motion.conventions import Floats

# Bone offsets that a model need not tell apart, m.
SAME_BONE = 5e-4
# A Gaussian field is conditioned worse than one of Matérn: what it gains has to be worth that.
CLEARLY = 0.95
# Standard errors by which a field of the controls has to be better than none.
SURE = 2.0


@dataclass(frozen=True)
class Fitted:
    """A field, the share of the variation that it explains, and residuals (N, m) left out."""

    field: Field
    explained: float
    residuals: Floats


def chosen(settings: Kriging, samples: Samples, values: Floats) -> Tuned:
    """Field of values (N, m) of the first covariance to be tried, or one of clearly less
    leave-one-out error."""
    first, *others = (tuned(settings, name, samples, values) for name in settings.covariances)
    best = min(others, key=lambda field: field.unexplained, default=first)
    return best if best.unexplained < CLEARLY * first.unexplained else first


def tuned(settings: Kriging, covariance: str, samples: Samples, values: Floats) -> Tuned:
    """Field of values (N, m) of least leave-one-out error among the drifts to be tried."""
    guesses = [
        tune.first_guess(samples.half_ranges, values, covariance, drifts)
        for drifts in settings.drifts
    ]
    found = [tune.tune(guess, samples, values, settings.nugget) for guess in guesses]
    return min(found, key=lambda field: field.unexplained)


def fit(settings: Kriging, covariance: str, samples: Samples, values: Floats) -> Fitted:
    """Field of values (N, m): of the controls, or their mean where those do not explain them."""
    if np.ptp(values, axis=0).max() == 0.0:
        return Fitted(Constant(values[0]), 0.0, np.zeros_like(values))
    found = tuned(settings, covariance, samples, values)
    explained = 1.0 - found.unexplained
    # Where the recipe gives a nugget, it has decided that the controls explain the samples.
    if not _sure(found, samples, values) and settings.nugget is None:
        return Fitted(Constant(values.mean(axis=0)), explained, samples.from_mean(values))
    return Fitted(kriging.solve(found.hyper, samples.points, values), explained, found.residuals)


def _sure(found: Tuned, samples: Samples, values: Floats) -> bool:
    """Whether leaving-one-out gains on the mean of the others by more than its standard error.

    Scales and nugget were chosen for this very gain: a small one is what chance can give them.
    """
    from_mean = np.sum(np.square(samples.from_mean(values)), axis=1)
    gains = from_mean - np.sum(np.square(found.residuals), axis=1)
    return bool(gains.mean() > SURE * gains.std(ddof=1) / np.sqrt(len(gains)))


def proportions(offsets: Floats) -> tuple[Proportions, Floats]:
    """Mean and directions of bone offsets (N, J, 3), and each clip's coefficients (N, r)."""
    mean = offsets.mean(axis=0)
    centred = (offsets - mean).reshape(len(offsets), -1)
    left, values, right = np.linalg.svd(centred, full_matrices=False)
    rank = 1
    while rank < len(values) and _worst(centred, left, values, right, rank) > SAME_BONE:
        rank += 1
    turned = signs(right[:rank])
    directions = (turned[:, None] * right[:rank]).reshape(rank, -1, 3)
    # The root has no bone; the decomposition leaves a rounding error where it was.
    directions[:, 0] = 0.0
    return Proportions(mean, directions), left[:, :rank] * values[:rank] * turned


def signs(rows: Floats) -> Floats:
    """Sign (r,) of the largest entry of each row, so that none hangs on the machine; of a row of no
    length, one."""
    largest = np.argmax(np.round(np.abs(rows), 9), axis=1)
    return np.where(rows[np.arange(len(rows)), largest] < 0, -1.0, 1.0)


def _worst(centred: Floats, left: Floats, values: Floats, right: Floats, rank: int) -> float:
    kept = (left[:, :rank] * values[:rank]) @ right[:rank]
    return float(np.abs(centred - kept).max())
