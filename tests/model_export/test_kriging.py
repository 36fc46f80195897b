"""Tests of universal kriging: its theorems, and the samples that it refuses."""

from dataclasses import replace

import numpy as np
import pytest

from posefield.common.errors import TrainingError
from posefield.kriging import kriging_model
from posefield.kriging.kriging_model import Hyper
from posefield_train.kriging import universal_kriging
from posefield_train.kriging.kriging_graph import COVARIANCES

# The systems here have condition numbers below 1e5.
TOLERANCE = 1e-9
NAMES = ("height", "turn", "reach")


@pytest.fixture(params=COVARIANCES)
def covariance(request):
    return request.param


@pytest.fixture(params=[(0,), (1,), (0, 1), (0, 1, 1)], ids=["constant", "linear", "both", "mixed"])
def hyper(request, covariance):
    return Hyper(covariance, request.param, np.array([0.5, 0.9, 1.4]), 0.1, 0.0)


def each_drift(hyper):
    """The same field with each of its drifts alone."""
    return [replace(hyper, drifts=(degree,)) for degree in hyper.drifts]


@pytest.fixture
def samples(rng):
    return rng.uniform(-1.0, 1.0, size=(30, 3))


@pytest.fixture
def values(rng):
    return rng.normal(size=(30, 4))


@pytest.fixture
def points(rng):
    return rng.uniform(-1.5, 1.5, size=(20, 3))


def far(a, b):
    return np.max(np.abs(a - b))


def linear(points):
    return 2.0 + points @ np.array([[1.0, -3.0], [0.5, 0.0], [0.0, 7.0]])


def test_without_nugget_data_come_back_at_the_data_points(hyper, samples, values):
    exact = universal_kriging.solve(replace(hyper, nugget=0.0), samples, values)
    assert far(exact.predict(samples), values) < TOLERANCE
    assert far(exact.variance(samples), 0.0) < TOLERANCE
    smoothed = universal_kriging.solve(hyper, samples, values)
    assert far(smoothed.predict(samples), values) > 1e-2


def test_weights_add_up_to_one_and_reproduce_the_drift(hyper, samples, points):
    weights = universal_kriging.solve(hyper, samples, samples).weights(points)
    assert far(weights.sum(axis=1), 1.0) < TOLERANCE
    away = far(weights @ samples, points)
    assert away < TOLERANCE if hyper.drifts == (1,) else away > 1e-2
    near = kriging_model.covariances(hyper, points, samples)
    assert far(near.sum(axis=1), 1.0) > 1e-2


def test_order_of_samples_does_not_matter(hyper, samples, values, points, rng):
    order = rng.permutation(30)
    field = universal_kriging.solve(hyper, samples, values)
    shuffled = universal_kriging.solve(hyper, samples[order], values[order])
    assert far(shuffled.predict(points), field.predict(points)) < TOLERANCE
    assert far(shuffled.variance(points), field.variance(points)) < TOLERANCE
    assert far(shuffled.weights(points), field.weights(points)[:, order]) < TOLERANCE
    mixed = universal_kriging.solve(hyper, samples[order], values)
    assert far(mixed.predict(points), field.predict(points)) > 1e-2


def test_variance_is_that_of_the_error_of_the_weights(hyper, samples, values, points):
    field = universal_kriging.solve(hyper, samples, values)
    w = field.weights(points)
    own = kriging_model.covariances(hyper, samples, samples) + hyper.nugget * np.eye(30)
    cross = kriging_model.covariances(hyper, points, samples)
    expected = 1.0 - 2.0 * np.sum(w * cross, axis=1) + np.sum((w @ own) * w, axis=1)
    assert far(field.variance(points), expected) < TOLERANCE
    simple = 1.0 - np.sum(cross @ np.linalg.inv(own) * cross, axis=1)
    assert far(field.variance(points), simple) > 1e-3


def test_weights_are_the_best_unbiased_ones(hyper, samples, values, points, rng):
    field = universal_kriging.solve(hyper, samples, values)
    own = kriging_model.covariances(hyper, samples, samples) + hyper.nugget * np.eye(30)
    cross = kriging_model.covariances(hyper, points, samples)
    best = field.weights(points)
    functions = kriging_model.drift(samples, 3, max(hyper.drifts))
    free = np.linalg.qr(functions, mode="complete")[0][:, functions.shape[1] :]

    def error(w):
        return 1.0 - 2.0 * np.sum(w * cross, axis=1) + np.sum((w @ own) * w, axis=1)

    others = [best + 0.1 * rng.normal(size=(20, free.shape[1])) @ free.T for _ in range(10)]
    if len(hyper.drifts) == 1:
        assert all(np.all(error(other) > error(best)) for other in others)
    else:
        # Averaged weights are no optimum: those of the constant drift alone have less variance.
        constant = universal_kriging.solve(each_drift(hyper)[0], samples, values)
        assert np.all(error(constant.weights(points)) < error(best))


def left_out_one_by_one(hyper, samples, values, groups):
    """Residuals and variances of every sample by fields from all other groups, solved anew."""
    residuals, variances = np.empty_like(values), np.empty(len(samples))
    for group in np.unique(groups):
        own = groups == group
        field = universal_kriging.solve(hyper, samples[~own], values[~own])
        residuals[own] = values[own] - field.predict(samples[own])
        variances[own] = field.variance(samples[own]) + hyper.nugget
    return residuals, variances


ALONE = np.arange(30)
# Groups of one to five, of which no two neighbours need be of one.
TAKES = np.repeat(ALONE, [5, 4, 3, 3, 2, 2, 2, 1, 1, 1, 1, 1, 1, 1, 1, 1] + 14 * [0])[
    np.random.Generator(np.random.PCG64(3)).permutation(30)
]


@pytest.mark.parametrize("groups", [ALONE, TAKES], ids=["alone", "takes"])
def test_leaving_out_in_closed_form_is_what_leaving_out_gives(hyper, samples, values, groups):
    matrix = kriging_model.leave_out(hyper, samples, groups)
    residuals, variances = left_out_one_by_one(hyper, samples, values, groups)
    assert far(matrix @ values, residuals) < TOLERANCE
    own = np.sum((matrix @ kriging_model.noisy(hyper, samples)) * matrix, axis=1)
    assert far(own, variances) < TOLERANCE
    # Negative controls: nothing left out, and others left out together.
    fitted = values - universal_kriging.solve(hyper, samples, values).predict(samples)
    assert far(fitted, residuals) > 1e-2
    other = TAKES if groups is ALONE else ALONE
    assert far(kriging_model.leave_out(hyper, samples, other) @ values, residuals) > 1e-2


def check(samples, degree=1, nugget_is_zero=False, names=NAMES):
    return universal_kriging.check_samples(
        samples, names[: samples.shape[1]], degree, nugget_is_zero
    )


def refusal(*given, **more):
    with pytest.raises(TrainingError) as refused:
        check(*given, **more)
    return str(refused.value)


def test_too_few_samples_are_refused(samples):
    assert refusal(samples[:4]) == (
        "4 samples, expected at least 5 for 3 controls and a drift of degree 1"
    )
    assert refusal(samples[:1], degree=0) == (
        "1 samples, expected at least 2 for 3 controls and a drift of degree 0"
    )


@pytest.mark.parametrize("degree", [0, 1])
def test_constant_control_is_refused_by_name(samples, degree):
    samples[:, 1] = 0.25
    assert refusal(samples, degree=degree) == (
        "control 'turn' has the value 0.25 in all 30 samples, expected at least two values; "
        "leave it out of the recipe"
    )


def test_control_that_follows_from_the_others_is_refused(samples):
    samples[:, 2] = 3.0 - 2.0 * samples[:, 0] + samples[:, 1]
    message = "controls ('height', 'turn', 'reach'): one of them follows linearly from the others"
    assert refusal(samples) == message
    check(samples, degree=0)


def test_two_samples_at_one_point_are_refused_without_a_nugget(samples):
    samples[17] = samples[4]
    assert refusal(samples, nugget_is_zero=True) == (
        "samples 5 and 18 have equal controls: a nugget of zero expects them to differ; "
        "allow a nugget, or leave one out"
    )
    check(samples, nugget_is_zero=False)
