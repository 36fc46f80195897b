"""Tests of performer labels in the covariances of a kriging model."""

from dataclasses import replace

import numpy as np
import pytest
from label_kernels import performers, vary

from posefield.kriging import kriging_model
from posefield_train.kriging import sample_points, universal_kriging
from posefield_train.kriging.covariance_graph import COVARIANCES
from posefield_train.kriging.universal_kriging import Hyper

TOLERANCE = 1e-9
PERFORMERS = ("ann", "bob", "cy")
CORRELATION, OFFSET, TREND = 0.6, 0.4, 1.5


@pytest.fixture(params=COVARIANCES)
def hyper(request):
    kernels = performers(3, CORRELATION, OFFSET)
    return Hyper(request.param, (0, 1), np.array([0.5, 0.9]), 0.1, TREND, kernels)


def who(*names):
    named = [{"performer": name} for name in names]
    return sample_points.label_weights(named, {"performer": PERFORMERS})


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
    assert sample_points.label_weights([{"performer": "ann"}, {}], {}).shape == (2, 0)


def test_covariance_is_stationary_with_an_offset_and_a_trend(hyper, laid):
    controls = laid[:, :2]
    gaps = (controls[:, None] - controls) * hyper.scales
    same = (np.argmax(laid[:, None, 2:], axis=-1) == np.argmax(laid[:, 2:], axis=-1)) * 1.0
    plain = COVARIANCES[hyper.covariance].numpy(np.sum(gaps**2, axis=-1))
    expected = plain * np.where(same, 1.0, CORRELATION) + OFFSET * same
    expected += TREND * controls @ controls.T
    assert far(universal_kriging.covariances(hyper, laid, laid), expected) < 1e-12
    assert far(np.diagonal(expected), kriging_model.prior_variances(hyper, laid)) < 1e-12
    for name in ("correlation", "offset", "trend"):
        values = {"correlation": CORRELATION, "offset": OFFSET, "trend": TREND}
        other = vary(hyper, **{name: 0.9 * values[name]})
        assert far(universal_kriging.covariances(other, laid, laid), expected) > 1e-2


@pytest.mark.parametrize("correlation", [0.0, CORRELATION, 1.0])
@pytest.mark.parametrize(("offset", "trend"), [(0.0, 0.0), (OFFSET, TREND), (30.0, 300.0)])
def test_covariances_of_labelled_samples_are_positive_definite(
    hyper, laid, correlation, offset, trend
):
    own = vary(hyper, correlation=correlation, offset=offset, trend=trend)
    assert np.linalg.eigvalsh(universal_kriging.covariances(own, laid, laid))[0] > -1e-10
    # Negative control: performers who are further from one another than opposites.
    beyond = vary(hyper, correlation=-1.0, offset=0.0, trend=0.0)
    three = np.hstack([np.zeros((3, 2)), who(*PERFORMERS)])
    assert np.linalg.eigvalsh(universal_kriging.covariances(beyond, three, three))[0] < -0.5


def test_far_outside_only_linear_functions_are_left(hyper, laid, values):
    """Of a performer the offset is left, and of controls the trend and the drift."""
    far_away = np.full((3, 2), 50.0)
    asked = np.hstack([far_away, who("ann", "bob", "eve")])
    for drifts in ((0,), (1,), (0, 1)):
        own = replace(hyper, drifts=drifts)
        field = universal_kriging.solve(own, laid, values)
        linear = kriging_model.linear_functions(own, asked)
        expected = linear @ kriging_model.linear_terms(own, laid) @ field.dual
        assert far(field.predict(asked), expected) < TOLERANCE
        assert far(expected[:1], expected) > 1e-3
        alike = universal_kriging.solve(vary(own, offset=0.0), laid, values).predict(asked)
        assert far(alike, alike[:1]) < TOLERANCE
        assert far(field.predict(0.5 * asked), expected) > 1e-2


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
