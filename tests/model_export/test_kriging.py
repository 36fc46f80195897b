"""Universal kriging: its theorems, and the samples it refuses."""

from dataclasses import replace

import numpy as np
import pytest

from model_export import kriging
from model_export.covariance import COVARIANCES
from model_export.kriging import Hyper
from service.motion.errors import TrainingError

# The systems here have condition numbers below 1e5.
TOLERANCE = 1e-9
NAMES = ("height", "turn", "reach")


@pytest.fixture(params=COVARIANCES)
def covariance(request):
    return request.param


@pytest.fixture(params=[0, 1], ids=["constant drift", "linear drift"])
def hyper(request, covariance):
    return Hyper(covariance, request.param, np.array([0.5, 0.9, 1.4]), 0.1)


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
    exact = kriging.solve(replace(hyper, nugget=0.0), samples, values)
    assert far(exact.predict(samples), values) < TOLERANCE
    assert far(exact.variance(samples), 0.0) < TOLERANCE
    smoothed = kriging.solve(hyper, samples, values)
    assert far(smoothed.predict(samples), values) > 1e-2


def test_field_with_a_nugget_is_continuous_at_the_data_points(hyper, samples, values):
    field = kriging.solve(hyper, samples, values)
    beside = field.predict(samples + 1e-9)
    assert far(field.predict(samples), beside) < 1e-6
    # A nugget that stands in the query as well would jump to the data there.
    assert far(values, beside) > 1e-2


def test_drift_is_reproduced(hyper, samples, points):
    field = kriging.solve(hyper, samples, np.hstack([np.full((30, 1), 5.0), linear(samples)]))
    found = field.predict(points)
    assert far(found[:, 0], 5.0) < TOLERANCE
    away = far(found[:, 1:], linear(points))
    assert away < TOLERANCE if hyper.drift else away > 1e-2


def test_weights_add_up_to_one_and_reproduce_the_drift(hyper, samples, points):
    weights = kriging.solve(hyper, samples, samples).weights(points)
    assert far(weights.sum(axis=1), 1.0) < TOLERANCE
    away = far(weights @ samples, points)
    assert away < TOLERANCE if hyper.drift else away > 1e-2
    near = kriging.covariances(hyper, points, samples)
    assert far(near.sum(axis=1), 1.0) > 1e-2


def test_weights_are_another_way_to_predict(hyper, samples, values, points):
    field = kriging.solve(hyper, samples, values)
    assert far(field.weights(points) @ values, field.predict(points)) < TOLERANCE
    assert far(field.weights(points) @ values[::-1], field.predict(points)) > 1e-2


def test_vector_is_kriged_as_its_components(hyper, samples, values, points):
    together = kriging.solve(hyper, samples, values).predict(points)
    alone = [kriging.solve(hyper, samples, column[:, None]).predict(points) for column in values.T]
    assert far(together, np.hstack(alone)) < 1e-12
    assert far(together, np.hstack(alone[::-1])) > 1e-2


def test_order_of_samples_does_not_matter(hyper, samples, values, points, rng):
    order = rng.permutation(30)
    field = kriging.solve(hyper, samples, values)
    shuffled = kriging.solve(hyper, samples[order], values[order])
    assert far(shuffled.predict(points), field.predict(points)) < TOLERANCE
    assert far(shuffled.variance(points), field.variance(points)) < TOLERANCE
    assert far(shuffled.weights(points), field.weights(points)[:, order]) < TOLERANCE
    mixed = kriging.solve(hyper, samples[order], values)
    assert far(mixed.predict(points), field.predict(points)) > 1e-2


def test_scales_stretch_the_controls(hyper, samples, values, points):
    scaled = kriging.solve(
        replace(hyper, scales=np.ones(3)), samples * hyper.scales, values
    ).predict(points * hyper.scales)
    field = kriging.solve(hyper, samples, values)
    assert far(scaled, field.predict(points)) < TOLERANCE
    even = kriging.solve(replace(hyper, scales=np.ones(3)), samples, values)
    assert far(even.predict(points), field.predict(points)) > 1e-2


def test_variance_is_that_of_the_error_of_the_weights(hyper, samples, values, points):
    field = kriging.solve(hyper, samples, values)
    w = field.weights(points)
    own = kriging.covariances(hyper, samples, samples) + hyper.nugget * np.eye(30)
    cross = kriging.covariances(hyper, points, samples)
    expected = 1.0 - 2.0 * np.sum(w * cross, axis=1) + np.sum((w @ own) * w, axis=1)
    assert far(field.variance(points), expected) < TOLERANCE
    simple = 1.0 - np.sum(cross @ np.linalg.inv(own) * cross, axis=1)
    assert far(field.variance(points), simple) > 1e-3


def test_weights_are_the_best_unbiased_ones(hyper, samples, values, points, rng):
    field = kriging.solve(hyper, samples, values)
    own = kriging.covariances(hyper, samples, samples) + hyper.nugget * np.eye(30)
    cross = kriging.covariances(hyper, points, samples)
    best = field.weights(points)
    unbiased = np.linalg.qr(kriging.drift(samples, hyper.drift), mode="complete")[0]
    free = unbiased[:, kriging.drift(samples, hyper.drift).shape[1] :]

    def error(w):
        return 1.0 - 2.0 * np.sum(w * cross, axis=1) + np.sum((w @ own) * w, axis=1)

    for _ in range(10):
        other = best + 0.1 * rng.normal(size=(20, free.shape[1])) @ free.T
        assert np.all(error(other) > error(best))


def test_variance_grows_away_from_the_samples(hyper, samples, values):
    field = kriging.solve(hyper, samples, values)
    inside, outside = field.variance(np.array([[0.0, 0.0, 0.0], [9.0, 9.0, 9.0]]))
    assert 0.0 < inside < outside
    assert outside > 1.0


def test_leave_one_out_in_closed_form_is_what_leaving_out_gives(hyper, samples, values):
    inverse = kriging.invert(hyper, samples)
    residuals, variances = kriging.leave_one_out(inverse, values)
    fitted = values - kriging.solve(hyper, samples, values).predict(samples)
    for i in range(30):
        kept = np.arange(30) != i
        field = kriging.solve(hyper, samples[kept], values[kept])
        own = values[i] - field.predict(samples[i : i + 1])[0]
        assert far(residuals[i], own) < TOLERANCE
        assert far(variances[i], field.variance(samples[i : i + 1])[0] + hyper.nugget) < TOLERANCE
        assert far(fitted[i], own) > 1e-3


def check(samples, degree=1, nugget_is_zero=False, names=NAMES):
    kriging.check(samples, names[: samples.shape[1]], degree, nugget_is_zero)


def refusal(*given, **more):
    with pytest.raises(TrainingError) as refused:
        check(*given, **more)
    return str(refused.value)


def test_good_samples_are_taken(samples):
    check(samples, degree=1, nugget_is_zero=True)
    check(samples[:5], degree=1)
    check(samples[:2], degree=0)


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


def test_two_samples_at_one_point_are_averaged_by_a_nugget(hyper, samples, values):
    twice = np.vstack([samples, samples[:1]])
    both = np.vstack([values, -values[:1]])
    field = kriging.solve(hyper, twice, both)
    assert far(*field.weights(samples[:1])[0, [0, 30]]) < TOLERANCE
