"""Comparison of kriging with SciPy's radial basis functions and GSTools' universal kriging."""

import gstools
import numpy as np
import pytest
from gstools.krige import Universal
from scipy.interpolate import RBFInterpolator

from posefield.kriging import kriging_model
from posefield.kriging.kriging_model import RATE52, Hyper
from posefield_train.kriging import kriging_graph, universal_kriging

TOLERANCE = 1e-9
NUGGET = 0.05


@pytest.fixture
def samples(rng):
    return rng.uniform(-1.0, 1.0, size=(40, 4))


@pytest.fixture
def values(rng):
    return rng.normal(size=(40, 5))


@pytest.fixture
def points(rng):
    return rng.uniform(-1.2, 1.2, size=(15, 4))


@pytest.mark.parametrize("nugget", [0.0, NUGGET])
@pytest.mark.parametrize("degree", [0, 1])
def test_gaussian_field_is_scipys(samples, values, points, degree, nugget):
    scales = np.array([0.8, 1.1, 0.9, 1.4])
    own = universal_kriging.solve(
        Hyper("gaussian", (degree,), scales, nugget, 0.0), samples, values
    )
    found = own.predict(points)

    def theirs(factor=3.0, smoothing=nugget, other=degree):
        """exp(-(εr)²) there, exp(-3 r²) here; the scales stretch the controls beforehand."""
        given = {"kernel": "gaussian", "epsilon": np.sqrt(factor), "degree": other}
        return RBFInterpolator(samples * scales, values, smoothing=smoothing, **given)(
            points * scales
        )

    assert np.max(np.abs(found - theirs())) < TOLERANCE
    assert np.max(np.abs(found - theirs(factor=1.0))) > 1e-2
    assert np.max(np.abs(found - theirs(smoothing=nugget + 0.01))) > 1e-3
    assert np.max(np.abs(found - theirs(other=1 - degree))) > 1e-2


# Lengths at which GSTools' models, their own rescaling undone, have our practical range of one.
MODELS = {
    "exponential": (gstools.Exponential, {}, 1.0 / 3.0),
    "gaussian": (gstools.Gaussian, {}, 1.0 / np.sqrt(3.0)),
    "spherical": (gstools.Spherical, {}, 1.0),
    "matern32": (gstools.Matern, {"nu": 1.5}, np.sqrt(1.5) / kriging_graph.RATE32),
    "matern52": (gstools.Matern, {"nu": 2.5}, np.sqrt(2.5) / RATE52),
}


def theirs(name, length, samples, values, points, nugget=NUGGET):
    """Value and variance of GSTools for one component."""
    make, more, unit = MODELS[name]
    model = make(dim=samples.shape[1], var=1.0, len_scale=length * unit, rescale=1.0, **more)
    krige = Universal(
        model, samples.T, values, "linear", exact=False, cond_err=nugget, pseudo_inv=False
    )
    return krige(points.T, return_var=True)


@pytest.mark.parametrize("name", MODELS)
def test_value_and_variance_are_those_of_gstools(name, samples, values, points):
    if name == "spherical":
        # It is no covariance in four dimensions, and GSTools says so.
        samples, points = samples[:, :3], points[:, :3]
    scales = np.full(samples.shape[1], 1.0 / 1.6)
    own = universal_kriging.solve(Hyper(name, (1,), scales, NUGGET, 0.0), samples, values)
    found, variance = own.predict(points), own.variance(points)
    for component in (0, 3):
        value, error = theirs(name, 1.6, samples, values[:, component], points)
        assert np.max(np.abs(found[:, component] - value)) < TOLERANCE
        assert np.max(np.abs(variance - error)) < TOLERANCE
    value, error = theirs(name, 1.7, samples, values[:, 3], points)
    assert np.max(np.abs(found[:, 3] - value)) > 1e-3
    assert np.max(np.abs(variance - error)) > 1e-3
    value, error = theirs(name, 1.6, samples, values[:, 3], points, 2.0 * NUGGET)
    assert np.max(np.abs(found[:, 3] - value)) > 1e-3
    assert np.max(np.abs(variance - error)) > 1e-3


@pytest.mark.parametrize("nugget", [0.0, NUGGET])
def test_two_drifts_are_the_mean_of_scipys_two_degrees(samples, values, points, nugget):
    scales = np.array([0.8, 1.1, 0.9, 1.4])
    found = universal_kriging.solve(Hyper("gaussian", (0, 1), scales, nugget, 0.0), samples, values)
    given = {"kernel": "gaussian", "epsilon": np.sqrt(3.0), "smoothing": nugget}
    both = [
        RBFInterpolator(samples * scales, values, degree=degree, **given)(points * scales)
        for degree in (0, 1)
    ]
    assert np.max(np.abs(found.predict(points) - np.mean(both, axis=0))) < TOLERANCE
    assert np.max(np.abs(found.predict(points) - both[0])) > 1e-2


@pytest.mark.parametrize("drifts", [(0,), (1,), (0, 1)], ids=str)
def test_groups_left_out_are_what_scipy_predicts_from_the_rest(samples, values, drifts):
    scales = np.array([0.8, 1.1, 0.9, 1.4])
    groups = np.repeat(np.arange(10), 4)
    hyper = Hyper("gaussian", drifts, scales, NUGGET, 0.0)
    found = kriging_model.leave_out(hyper, samples, groups) @ values
    given = {"kernel": "gaussian", "epsilon": np.sqrt(3.0), "smoothing": NUGGET}
    for group in range(10):
        own = groups == group
        predicted = [
            RBFInterpolator(samples[~own] * scales, values[~own], degree=degree, **given)(
                samples[own] * scales
            )
            for degree in drifts
        ]
        assert np.max(np.abs(found[own] - values[own] + np.mean(predicted, axis=0))) < TOLERANCE
    alone = kriging_model.leave_out(hyper, samples, np.arange(40)) @ values
    assert np.max(np.abs(found - alone)) > 1e-2
