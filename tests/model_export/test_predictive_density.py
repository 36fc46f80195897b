"""Tests of the tuning of single values by the density of left-out recordings."""

from dataclasses import replace

import numpy as np
import pytest
from label_kernels import performers

from posefield.kriging import kriging_model
from posefield.kriging.kriging_model import Hyper
from posefield_train.kriging import (
    coefficient_models,
    kriging_tuning,
    tuning_loss,
    universal_kriging,
)
from posefield_train.kriging.sample_points import SamplePoints
from posefield_train.kriging.tuning_loss import (
    PRIORS,
    LeaveOneOutLoss,
    PoseLoss,
    PredictiveDensityLoss,
    TuningProblem,
)
from posefield_train.source.recipe import Kriging

COUNT, TAKES, PEOPLE = 30, 12, 3
HYPER = Hyper("matern52", (0,), np.array([0.6, 0.4]), 0.2, 0.5, performers(PEOPLE, 0.7, 0.6))
NAMES = (("offset", 0), ("trend", 0), ("nugget", 0))


@pytest.fixture
def laid(rng):
    recordings = np.arange(COUNT) % TAKES
    points = np.hstack([rng.uniform(-1.0, 1.0, (COUNT, 2)), np.eye(PEOPLE)[recordings % PEOPLE]])
    return SamplePoints(points, 2, recordings, (PEOPLE,))


def loss_of(laid, values, kind=PredictiveDensityLoss, effector=None):
    return kind(TuningProblem(laid, values, effector=effector), HYPER, NAMES, own_scales=False)


def in_search_units(hyper):
    return np.log([hyper.labels[0].offset, hyper.trend, hyper.nugget])


def take_density(laid, values, recording):
    """Squared residual in units of its covariance, and the logarithm of the determinant."""
    own = laid.groups == recording
    known, asked = laid.points[~own], laid.points[own]
    inverse = np.linalg.inv(kriging_model.noisy(HYPER, known))
    near = kriging_model.covariances(HYPER, asked, known)
    left = 1.0 - near @ inverse.sum(axis=1)
    spread = kriging_model.noisy(HYPER, asked) - near @ inverse @ near.T
    spread += np.outer(left, left) / inverse.sum()
    field = universal_kriging.solve(HYPER, known, values[~own])
    missed = (values[own] - field.predict(asked))[:, 0]
    return missed @ np.linalg.solve(spread, missed), np.linalg.slogdet(spread)[1]


def test_loss_is_the_density_of_takes_left_out_one_by_one(laid, rng):
    values = rng.normal(size=(COUNT, 1))
    squares, logarithms = zip(*(take_density(laid, values, t) for t in range(TAKES)), strict=True)
    expected = 0.5 * COUNT * np.log(sum(squares)) + 0.5 * sum(logarithms)
    assert loss_of(laid, values).of_samples(HYPER)[0] == pytest.approx(expected, rel=1e-9)
    # Negative control: clips left out one by one have another density.
    single = replace(laid, groups=np.arange(COUNT))
    assert abs(loss_of(single, values).of_samples(HYPER)[0] - expected) > 0.1


@pytest.mark.parametrize("kind", [PredictiveDensityLoss, PoseLoss])
def test_gradient_is_that_of_finite_differences(laid, rng, kind):
    effector = rng.normal(size=(COUNT, 3, 1)) if kind is PoseLoss else None
    loss, x = loss_of(laid, rng.normal(size=(COUNT, 1)), kind, effector), in_search_units(HYPER)
    values = [
        [loss.value_and_slope(x + sign * step)[0] for sign in (1, -1)] for step in 1e-5 * np.eye(3)
    ]
    expected = np.array([(after - before) / 2e-5 for after, before in values])
    slope = loss.value_and_slope(x)[1]
    assert np.abs(slope - expected).max() < 1e-6 * np.abs(expected).max()
    assert np.abs(loss.value_and_slope(x + 0.05)[1] - expected).max() > 1e-3


def test_the_pose_is_tuned_by_squares_with_the_event_and_by_density(laid, rng):
    values, effector = rng.normal(size=(COUNT, 4)), rng.normal(size=(COUNT, 3, 2))
    squares, density, both = (
        loss_of(laid, values, kind, effector).of_samples(HYPER)[0]
        for kind in (LeaveOneOutLoss, PredictiveDensityLoss, PoseLoss)
    )
    assert both == pytest.approx(squares + density, rel=1e-12)
    # The event's joint counts in the squares alone.
    plain = loss_of(laid, values, PoseLoss).of_samples(HYPER)[0]
    without = loss_of(laid, values, LeaveOneOutLoss).of_samples(HYPER)[0]
    assert both - plain == pytest.approx(squares - without, rel=1e-9)
    assert squares - without > 1.0
    # Performers without names keep the squares alone.
    points = SamplePoints(laid.half_ranges, 2, laid.groups, unnamed=True)
    for samples, kind in ((laid, PoseLoss), (points, LeaveOneOutLoss)):
        strength = tuning_loss.UNNAMED_STRENGTH if samples.unnamed else tuning_loss.POSE_STRENGTH
        problem = TuningProblem(samples, values, strength=strength, unnamed=samples.unnamed)
        expected = kriging_tuning.tune(problem, "matern52", None, loss=kind).hyper
        chosen = coefficient_models.choose_covariance(
            Kriging(covariance="matern52"), samples, values
        )
        assert chosen.hyper.nugget == expected.nugget


@pytest.mark.parametrize("columns", [1, 2])
def test_quantities_beside_the_pose_are_tuned_by_density(laid, rng, columns):
    values = rng.normal(size=(COUNT, columns)) + laid.half_ranges[:, :columns]
    problem = TuningProblem(laid, values, strength=tuning_loss.OTHER_STRENGTH)
    tuned = kriging_tuning.tune_beside(problem, HYPER).hyper
    assert coefficient_models.fit(Kriging(), HYPER, laid, values).field.hyper.nugget == tuned.nugget
    loss, at = (
        PredictiveDensityLoss(problem, HYPER, NAMES, own_scales=False),
        in_search_units(tuned),
    )
    near = [loss.value_and_slope(at + 0.1 * step)[0] for step in (*np.eye(3), *-np.eye(3))]
    inside = [
        PRIORS[name].low < x < PRIORS[name].high for (name, _), x in zip(NAMES, at, strict=True)
    ]
    assert all(inside)
    assert loss.value_and_slope(at)[0] < min(near)
    # Negative control: squared residuals are least elsewhere.
    squares = LeaveOneOutLoss(problem, HYPER, NAMES, own_scales=False)
    assert np.abs(squares.value_and_slope(at)[1]).max() > 1e-2
