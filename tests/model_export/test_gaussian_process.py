"""Tests of travel with ranges of its own."""

from dataclasses import replace

import numpy as np
import pytest
from label_kernels import performers

from posefield.kriging.kriging_model import Hyper
from posefield_train.evaluate import predictions
from posefield_train.kriging import coefficient_models, gaussian_process
from posefield_train.kriging.kriging_bank import ConstantModel
from posefield_train.kriging.sample_points import SamplePoints
from posefield_train.source.recipe import Kriging

COUNT, TAKES, PEOPLE = 40, 20, 2
# Ranges of a pose, far shorter than those of the travel.
HYPER = Hyper("matern52", (0,), np.array([1.0, 1.0]), 0.2, 0.5, performers(PEOPLE, 0.3, 0.6))


@pytest.fixture
def samples(rng):
    recordings = np.arange(COUNT) % TAKES
    points = np.hstack([rng.uniform(-1.0, 1.0, (COUNT, 2)), np.eye(PEOPLE)[recordings % PEOPLE]])
    return SamplePoints(points, 2, recordings, (PEOPLE,))


@pytest.fixture
def travel(samples, rng):
    """Return travel (N, 3) that is nearly a function of the controls, equal for all performers."""
    x, y = samples.half_ranges.T
    values = np.stack([0.1 * x * y, 1.2 + 0.4 * x + 0.1 * x * x, 0.3 * y], axis=1)
    return values + 0.01 * rng.normal(size=values.shape)


def test_samples_are_smoothed_as_scikit_learn_predicts_them(samples, travel):
    smoothed, residuals = gaussian_process.smooth(samples, travel)
    expected = predictions.predict_process(samples, travel, samples.points)
    assert np.abs(smoothed - expected).max() < 1e-6
    assert np.abs(smoothed - travel).max() > 1e-3
    # Left-out takes are missed by more than samples, and by about the noise.
    assert 0.01 < residuals.std() < 0.02
    assert residuals.std() > (travel - smoothed).std()


def test_kriging_says_at_the_samples_what_the_process_says(samples, travel, rng):
    fitted = coefficient_models.fit(Kriging(), HYPER, samples, travel)
    own = gaussian_process.with_own_ranges(fitted, samples, travel)
    smoothed, residuals = gaussian_process.smooth(samples, travel)
    assert np.abs(own.field.predict(samples.points) - smoothed).max() < 1e-3
    assert own.field.hyper == fitted.field.hyper
    assert (own.residuals == residuals).all()
    assert fitted.explained < own.explained < 1.0
    # Between the samples it is nearer than the model was.
    points = np.hstack([rng.uniform(-0.9, 0.9, (200, 2)), np.eye(PEOPLE)[np.arange(200) % PEOPLE]])
    x, y = points.T[:2]
    true = np.stack([0.1 * x * y, 1.2 + 0.4 * x + 0.1 * x * x, 0.3 * y], axis=1)
    gaps = [np.abs(model.field.predict(points) - true).mean() for model in (own, fitted)]
    assert gaps[0] < 0.8 * gaps[1]


def test_a_model_that_left_out_takes_are_nearer_to_stays(samples, travel):
    fitted = coefficient_models.fit(Kriging(), HYPER, samples, travel)
    exact = replace(fitted, residuals=1e-3 * fitted.residuals)
    assert gaussian_process.with_own_ranges(exact, samples, travel) is exact
    constant = replace(fitted, field=ConstantModel(travel.mean(axis=0)))
    assert gaussian_process.with_own_ranges(constant, samples, travel) is constant
    large = replace(samples, inducing=np.arange(COUNT))
    assert gaussian_process.with_own_ranges(fitted, large, travel) is fitted
