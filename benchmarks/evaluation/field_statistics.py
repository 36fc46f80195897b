"""Statistics of the random fields that takes are drawn of, against the model's own."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from posefield.common.units import Floats, PerPoint, Points, PointValues
from posefield.kriging import kriging_model, random_field
from posefield.kriging.kriging_model import Hyper, KrigingWeights

SEEDS, FIELDS, PLACES, BINS = 24, 12, 48, 6
"""Seeds of a fold and independent fields of each; points at most; bins of distance."""
WRONG_SCALE = 0.5
"""Factor of the scales in the negative control of the variogram."""
FEWEST_PLACES = 5
"""Fewest points: fewer have too few pairs for the bins."""

Drawn = Annotated[Floats, "seeds fields points"]


@dataclass(frozen=True)
class FieldStatistics:
    """Statistics of one model's fields at points between its samples, each ideally 1.

    variogram: simulated over the model's semivariance, in bins of growing distance. variance: of
    takes over the kriging variance, mean over the points. mean_error: mean over seeds in standard
    errors, root mean square over the points. Of the negative controls, wrong_variogram has half the
    scales, unconditioned ignores the samples, and shared_errors has the same errors at the samples
    in all seeds.
    """

    variogram: tuple[float, ...]
    variance: float
    mean_error: float
    wrong_variogram: tuple[float, ...]
    unconditioned: float
    shared_errors: float


def measure(weights: KrigingWeights, first_seed: int) -> FieldStatistics | None:
    """Return the statistics over seeds from `first_seed` on, other ones for each fold.

    None for a covariance without random fields, and for fewer than six samples.
    """
    hyper, points = weights.hyper, _places(weights)
    if not random_field.has_features(hyper) or len(points) < FEWEST_PLACES:
        return None
    seeds = [first_seed * SEEDS + step for step in range(SEEDS)]
    fields = [random_field.simulate(weights, seed, FIELDS) for seed in seeds]
    # Of another seed, so that the errors are independent of each field.
    errors = random_field.simulate(weights, first_seed * SEEDS + SEEDS, FIELDS).errors
    shared = [replace(field, errors=errors) for field in fields]
    wide = replace(hyper, scales=WRONG_SCALE * hyper.scales)
    free = _stacked([field.field.evaluate(points) for field in fields])
    wrong = _stacked(
        [random_field.draw_field(wide, seed, FIELDS).evaluate(points) for seed in seeds]
    )
    timings = _stacked([field.evaluate(points) for field in fields])
    variances = _kriging_variances(weights, points)
    return FieldStatistics(
        _variogram_ratios(free, hyper, points),
        _variance_ratio(timings, variances),
        _mean_error(timings),
        _variogram_ratios(wrong, hyper, points),
        _variance_ratio(free, variances),
        _mean_error(_stacked([field.evaluate(points) for field in shared])),
    )


def _stacked(values: Sequence[PointValues]) -> Drawn:
    """Return the values (B, m) of several seeds as one array (seeds, m, B)."""
    return np.array([value.T for value in values])


def _places(weights: KrigingWeights) -> Points:
    """Return points (B, d + p): half way between neighbours on the card, named as the first."""
    d = len(weights.hyper.scales)
    points = weights.samples[:-1].copy()
    points[:, :d] = 0.5 * (weights.samples[:-1, :d] + weights.samples[1:, :d])
    return points[:PLACES]


def _variance_ratio(values: Drawn, variances: PerPoint) -> float:
    # The mean of all takes is zero.
    return float(np.mean(np.mean(np.square(values), axis=(0, 1)) / variances))


def _mean_error(values: Drawn) -> float:
    errors = values.mean(axis=0) / (values.std(axis=0, ddof=1) / np.sqrt(len(values)))
    return float(np.sqrt(np.mean(np.square(errors))))


def _variogram_ratios(values: Drawn, hyper: Hyper, positions: Points) -> tuple[float, ...]:
    """Return simulated over the model's semivariance of pairs of points, in bins of distance."""
    rows, columns = np.triu_indices(len(positions), 1)
    prior = kriging_model.prior_variances(hyper, positions)
    covariances = kriging_model.covariances(hyper, positions, positions)[rows, columns]
    model = 0.5 * (prior[rows] + prior[columns]) - covariances
    simulated = 0.5 * np.mean(np.square(values[..., rows] - values[..., columns]), axis=(0, 1))
    bins = np.array_split(np.argsort(model, kind="stable"), BINS)
    return tuple(float(simulated[pairs].sum() / model[pairs].sum()) for pairs in bins)


def _kriging_variances(weights: KrigingWeights, positions: Points) -> PerPoint:
    """Return the variances (B,) of a new observation about the prediction, in sills."""
    hyper, samples = weights.hyper, weights.samples
    weights_at_points, across = (
        weights.weights(positions),
        kriging_model.covariances(hyper, positions, samples),
    )
    error = np.einsum(
        "bn,nm,bm->b", weights_at_points, kriging_model.noisy(hyper, samples), weights_at_points
    )
    prior = kriging_model.prior_variances(hyper, positions) + hyper.nugget
    return np.asarray(prior + error - 2.0 * np.sum(weights_at_points * across, axis=1))
