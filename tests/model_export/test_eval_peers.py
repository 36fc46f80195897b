"""Tests of the comparison methods, with equal controls and missing labels too."""

import numpy as np
import pytest
from scipy.interpolate import RBFInterpolator

from posefield_train.evaluate import interpolation_peers
from posefield_train.evaluate.interpolation_peers import INTERPOLATORS
from posefield_train.kriging.sample_points import SamplePoints

EXACT = 1e-8


def laid(points, labels=None):
    labels = np.zeros((len(points), 0)) if labels is None else labels
    both = np.hstack([points, labels])
    return SamplePoints(both, points.shape[1], np.arange(len(points)), (labels.shape[1],))


@pytest.fixture
def points(rng):
    return rng.uniform(-1.0, 1.0, (24, 3))


@pytest.fixture
def queries(rng):
    return rng.uniform(-0.8, 0.8, (7, 3))


def linear(x):
    return x @ np.array([[1.0, -2.0], [0.5, 0.0], [3.0, 1.0]]) + np.array([4.0, -1.0])


def curved(x):
    return np.stack([np.sin(3.0 * x[:, 0]) + x[:, 1], x[:, 2] ** 2], axis=1)


REPRODUCE_LINES = (
    "thin_plate",
    "linear_rbf",
    "cubic_rbf",
    "linear_regression",
    "quadratic_regression",
)


@pytest.mark.parametrize("name", INTERPOLATORS)
def test_a_constant_is_predicted_as_such(name, points, queries):
    found = INTERPOLATORS[name][0](laid(points), np.full((24, 2), 7.0), queries)
    assert found.shape == (7, 2)
    assert np.abs(found - 7.0).max() < 1e-6


@pytest.mark.parametrize("name", REPRODUCE_LINES)
def test_lines_are_reproduced_by_those_with_a_linear_part(name, points, queries):
    predict = INTERPOLATORS[name][0]
    found = predict(laid(points), linear(points), queries)
    assert np.abs(found - linear(queries)).max() < EXACT
    # Negative control: a curve is not a line.
    assert np.abs(predict(laid(points), curved(points), queries) - linear(queries)).max() > 0.1


@pytest.mark.parametrize("name", ["thin_plate", "linear_rbf", "cubic_rbf", "linear_coefficients"])
def test_interpolators_meet_their_samples(name, points):
    found = INTERPOLATORS[name][0](laid(points), curved(points), points)
    assert np.abs(found - curved(points)).max() < EXACT


@pytest.mark.parametrize("name", ["thin_plate_smoothed", "gp", "mean", "linear_regression"])
def test_what_smooths_does_not_meet_noise(name, points, rng):
    noise = rng.standard_normal((24, 2))
    found = INTERPOLATORS[name][0](laid(points), noise, points + 1e-3)
    assert np.abs(found - noise).max() > 0.1


def test_thin_plates_are_scipys_own(points, queries):
    values = curved(points)
    own = RBFInterpolator(points, values, kernel="thin_plate_spline", degree=1)(queries)
    found = INTERPOLATORS["thin_plate"][0](laid(points), values, queries)
    assert np.abs(found - own).max() < EXACT
    assert np.abs(INTERPOLATORS["cubic_rbf"][0](laid(points), values, queries) - own).max() > 1e-3


def test_smoothing_is_chosen_by_what_is_left_out(points, queries, rng):
    noisy = linear(points) + 0.3 * rng.standard_normal((24, 2))
    smoothed = interpolation_peers.thin_plate_smoothed(laid(points), noisy, queries)
    plain = INTERPOLATORS["thin_plate"][0](laid(points), noisy, queries)
    truth = linear(queries)
    assert np.abs(smoothed - truth).mean() < 0.7 * np.abs(plain - truth).mean()
    clean = interpolation_peers.thin_plate_smoothed(laid(points), linear(points), queries)
    assert np.abs(clean - truth).max() < 1e-6


def test_equal_controls_are_trials_of_one_motion(points, queries):
    values = curved(points)
    twice = laid(np.vstack([points, points]))
    apart = np.vstack([values + 0.2, values - 0.2])
    for name in ("thin_plate", "linear_rbf", "cubic_rbf", "thin_plate_smoothed"):
        found = INTERPOLATORS[name][0](twice, apart, queries)
        assert np.isfinite(found).all()
    found = INTERPOLATORS["thin_plate"][0](twice, apart, queries)
    assert (
        np.abs(found - INTERPOLATORS["thin_plate"][0](laid(points), values, queries)).max() < EXACT
    )


def test_the_nearest_of_the_same_performer_is_taken(points):
    labels = np.repeat(np.eye(2), 12, axis=0)
    values = np.arange(24.0)[:, None]
    asked = np.hstack([points[:1], [[0.0, 1.0]]])
    own = 12 + int(np.argmin(np.linalg.norm(points[12:] - points[0], axis=1)))
    assert interpolation_peers.nearest_of_performer(laid(points, labels), values, asked) == own
    nobody = np.hstack([points[:1], [[0.0, 0.0]]])
    assert interpolation_peers.nearest_of_performer(laid(points, labels), values, nobody) == 0


def test_the_process_tells_performers_apart_where_it_is_told(points, queries):
    labels = np.tile(np.eye(2), (12, 1))
    values = linear(points) + 5.0 * labels[:, :1]
    asked = np.hstack([queries, np.tile([0.0, 1.0], (7, 1))])
    truth = linear(queries)
    told = np.abs(
        interpolation_peers.gp_with_performers(laid(points, labels), values, asked) - truth
    ).mean()
    untold = np.abs(
        interpolation_peers.gp_without_performers(laid(points, labels), values, asked) - truth
    ).mean()
    assert told < 0.3 * untold


def test_outside_the_hull_the_nearest_is_taken(points):
    values = curved(points)
    far = np.array([[9.0, 9.0, 9.0]])
    nearest = np.argmin(np.linalg.norm(points - far, axis=1))
    found = interpolation_peers.linear_coefficients(laid(points), values, far)
    assert np.array_equal(found[0], values[nearest])


def test_one_control_is_interpolated_on_its_line():
    points = np.array([[0.5], [-1.0], [1.0]])
    values = np.array([[2.0], [0.0], [3.0]])
    found = interpolation_peers.linear_coefficients(
        laid(points), values, np.array([[0.75], [-0.25]])
    )
    assert found.ravel() == pytest.approx([2.5, 1.0])
