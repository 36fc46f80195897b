"""Tests of the comparison methods, with equal controls and missing labels too."""

import numpy as np
import pytest
from evaluation import linear_smoothers, methods, peers
from scipy.interpolate import RBFInterpolator

from posefield_train.kriging.sample_points import SamplePoints

EXACT = 1e-8
PEERS = (*peers.LINEAR_PEERS, "gp")


def predicted(name, samples, values, queries):
    """Return the prediction of a peer of libraries that has no labels, by its name."""
    settings, _ = peers.LINEAR_PEERS[name]
    choices = [linear_smoothers.smoother(peer, samples, queries) for peer in settings]
    return linear_smoothers.predict(choices, values)


def laid(points, labels=None):
    if labels is None:
        return SamplePoints(points, points.shape[1], np.arange(len(points)))
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


def test_a_constant_is_predicted_as_such(points, queries):
    predicted_values, _ = methods.peer_values(
        laid(points), {"pose": np.full((24, 2), 7.0)}, queries
    )
    assert set(predicted_values) == set(PEERS), "without labels none is there twice"
    for values in predicted_values.values():
        assert values["pose"].shape == (7, 2)
        assert np.abs(values["pose"] - 7.0).max() < 1e-6


@pytest.mark.parametrize("name", ["thin_plate", "cubic_rbf", "quadratic_regression"])
def test_lines_are_reproduced_by_those_with_a_linear_part(name, points, queries):
    found = predicted(name, laid(points), linear(points), queries)
    assert np.abs(found - linear(queries)).max() < EXACT
    # Negative control: a curve is not a line.
    assert (
        np.abs(predicted(name, laid(points), curved(points), queries) - linear(queries)).max() > 0.1
    )


def test_thin_plates_are_scipys_own(points, queries):
    values = curved(points)
    own = RBFInterpolator(points, values, kernel="thin_plate_spline", degree=1)(queries)
    found = predicted("thin_plate", laid(points), values, queries)
    assert np.abs(found - own).max() < EXACT
    assert np.abs(predicted("cubic_rbf", laid(points), values, queries) - own).max() > 1e-3


def test_the_nearest_of_the_same_performer_is_taken(points):
    labels = np.repeat(np.eye(2), 12, axis=0)
    values = np.arange(24.0)[:, None]
    asked = np.hstack([points[:1], [[0.0, 1.0]]])
    own = 12 + int(np.argmin(np.linalg.norm(points[12:] - points[0], axis=1)))
    assert peers.nearest_of_performer(laid(points, labels), values, asked) == own
    nobody = np.hstack([points[:1], [[0.0, 0.0]]])
    assert peers.nearest_of_performer(laid(points, labels), values, nobody) == 0


@pytest.fixture
def two(points):
    """Two performers, of whom one stands five units beside the other, and their labels."""
    labels = np.tile(np.eye(2), (12, 1))
    return laid(points, labels), linear(points) + 5.0 * labels[:, :1]


def test_every_peer_has_a_use_for_the_performer(two, queries):
    asked = np.hstack([queries, np.tile([0.0, 1.0], (len(queries), 1))])
    predicted_values, _ = methods.peer_values(two[0], {"pose": two[1]}, asked)
    expected = linear(queries)
    for name in PEERS:
        named, unnamed = (
            float(np.abs(predicted_values[name + end]["pose"] - expected).mean())
            for end in ("", methods.OPEN)
        )
        assert named < 0.75 * unnamed, name
