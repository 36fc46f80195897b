"""Tests of performer labels in the distances of a kriging model."""

from dataclasses import replace

import numpy as np
import pytest

from posefield_train.kriging import sample_points, universal_kriging
from posefield_train.kriging.covariance_graph import COVARIANCES
from posefield_train.kriging.universal_kriging import Hyper

TOLERANCE = 1e-9
PERFORMERS = ("ann", "bob", "cy")
LABEL = 0.7


@pytest.fixture(params=COVARIANCES)
def hyper(request):
    return Hyper(request.param, (0, 1), np.array([0.5, 0.9]), 0.1, LABEL)


def who(*names):
    return sample_points.performer_labels(names, PERFORMERS)


@pytest.fixture
def names(rng):
    return rng.choice(PERFORMERS, 24)


@pytest.fixture
def controls(rng):
    return rng.uniform(-1.0, 1.0, (24, 2))


@pytest.fixture
def laid(controls, names):
    return np.hstack([controls, who(*names)])


@pytest.fixture
def values(rng):
    return rng.normal(size=(24, 3))


def far(a, b):
    return np.max(np.abs(a - b))


def test_labels_are_ones_own_and_none_for_a_stranger():
    expected = [[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]]
    assert np.array_equal(who("bob", "ann", "eve"), expected)
    assert sample_points.performer_labels(("ann", "bob"), ()).shape == (2, 0)


def test_a_performer_is_nothing_from_himself_and_the_label_from_all_others(hyper):
    points = np.hstack([np.zeros((5, 2)), who("ann", "bob", "cy", "ann", "eve")])
    near = universal_kriging.covariances(hyper, points, points[:4])
    apart = COVARIANCES[hyper.covariance].numpy(np.array(LABEL**2))
    same = np.array([n == m for n in "abcae" for m in "abca"]).reshape(5, 4)
    assert far(near, np.where(same, 1.0, apart)) < 1e-12
    assert apart < 0.9


def test_labels_and_controls_add_up_as_squares(hyper, laid):
    gaps = (laid[:, None] - laid)[..., :2] * hyper.scales
    others = np.any(laid[:, None, 2:] != laid[:, 2:], axis=-1)
    squared = np.sum(gaps**2, axis=-1) + np.where(others, LABEL**2, 0.0)
    expected = COVARIANCES[hyper.covariance].numpy(squared)
    assert far(universal_kriging.covariances(hyper, laid, laid), expected) < 1e-12
    plain = COVARIANCES[hyper.covariance].numpy(np.sum(gaps**2, axis=-1))
    assert far(universal_kriging.covariances(hyper, laid, laid), plain) > 1e-2


@pytest.mark.parametrize("label", [0.05, LABEL, 4.0])
def test_covariances_of_labelled_samples_are_positive_definite(hyper, laid, label):
    """Performers are the corners of a simplex, one more dimension each, but for the spherical one:
    that is no covariance in more than three."""
    own = replace(hyper, label=label)
    least = np.linalg.eigvalsh(universal_kriging.covariances(own, laid, laid))[0]
    if hyper.covariance != "spherical":
        assert least > -1e-12
    # A distance that is none: two performers each near a third and far from one another.
    gaps = np.array([[0.0, 0.1, 2.0], [0.1, 0.0, 0.1], [2.0, 0.1, 0.0]])
    assert np.linalg.eigvalsh(COVARIANCES[hyper.covariance].numpy(gaps**2))[0] < -1e-2


def test_drift_does_not_see_the_labels(laid, controls):
    assert np.array_equal(universal_kriging.drift(laid, 2, 0), np.ones((24, 1)))
    assert np.array_equal(
        universal_kriging.drift(laid, 2, 1), np.hstack([np.ones((24, 1)), controls])
    )


def test_far_outside_only_the_drift_is_left_whoever_asks(hyper, laid, values):
    far_away = np.full((3, 2), 50.0)
    asked = np.hstack([far_away, who("ann", "bob", "eve")])
    for drifts in ((0,), (1,), (0, 1)):
        field = universal_kriging.solve(replace(hyper, drifts=drifts), laid, values)
        found = field.predict(asked)
        assert far(found, found[:1]) < TOLERANCE
        near = field.predict(np.hstack([np.zeros((3, 2)), who("ann", "bob", "eve")]))
        assert far(near, near[:1]) > 1e-2


def test_label_of_nothing_is_the_field_without(hyper, laid, controls, values):
    groups = np.arange(24) // 2
    own = replace(hyper, label=0.0)
    with_labels, without = (
        universal_kriging.solve(own, where, values) for where in (laid, controls)
    )
    assert far(with_labels.predict(laid), without.predict(controls)) < 1e-12
    assert far(with_labels.variance(laid), without.variance(controls)) < 1e-12
    both = [universal_kriging.leave_out(own, where, groups) for where in (laid, controls)]
    assert far(*both) < 1e-12
    apart = universal_kriging.solve(hyper, laid, values)
    assert far(apart.predict(laid), without.predict(controls)) > 1e-2
    assert far(universal_kriging.leave_out(hyper, laid, groups), both[1]) > 1e-2


def test_a_stranger_is_answered_with_less_certainty(hyper, laid, controls, names, values):
    field = universal_kriging.solve(hyper, laid, values)
    stranger = np.hstack([controls, who(*["eve"] * 24)])
    assert np.all(field.variance(stranger) > field.variance(laid))
    same = universal_kriging.solve(replace(hyper, label=0.0), laid, values)
    assert far(same.variance(stranger), same.variance(laid)) < 1e-12


def test_the_order_of_performers_does_not_matter(hyper, laid, values):
    renamed = np.hstack([laid[:, :2], laid[:, [4, 2, 3]]])
    found, other = (universal_kriging.solve(hyper, where, values) for where in (laid, renamed))
    assert far(found.predict(laid), other.predict(renamed)) < 1e-12
    assert far(found.predict(laid), other.predict(laid)) > 1e-2


def test_a_performer_left_out_is_a_stranger(hyper, laid, names, values):
    """Leave out whole performers, whose labels the rest then does not know."""
    _, groups = np.unique(names, return_inverse=True)
    found = universal_kriging.leave_out(hyper, laid, groups) @ values
    for performer in range(3):
        own = groups == performer
        field = universal_kriging.solve(hyper, laid[~own], values[~own])
        nobody = np.hstack([laid[own, :2], np.zeros((own.sum(), 3))])
        assert far(found[own], values[own] - field.predict(nobody)) < TOLERANCE
        other = np.hstack([laid[own, :2], np.eye(3)[[performer - 1] * own.sum()]])
        assert far(found[own], values[own] - field.predict(other)) > 1e-2
