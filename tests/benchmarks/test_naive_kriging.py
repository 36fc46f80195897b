"""Tests of naive kriging, the baseline: equal forms, and agreement with SciPy's weights."""

import numpy as np
import pytest
from paper import naive_kriging, variogram
from running import outputs
from scipy.interpolate import RBFInterpolator

from posefield_train.kriging.kriging_graph import COVARIANCES

SAMPLES, FRAMES, JOINTS = 25, 6, 4


@pytest.fixture
def points(rng):
    return rng.uniform(-1.0, 1.0, size=(SAMPLES, 3))


@pytest.fixture
def positions(points, rng):
    """Joint positions (N, T, J, 3) that follow the controls more and more closely."""
    bends = np.einsum("nd,tdjk->ntjk", points, rng.normal(size=(FRAMES, 3, JOINTS, 3)))
    noise = rng.normal(size=bends.shape) * np.linspace(0.5, 0.02, FRAMES)[:, None, None]
    return np.sin(2.0 * bends) + noise


@pytest.fixture
def values(positions, rng):
    """Pose vectors (N, T, D), of which positions are something else."""
    return np.cos(positions.reshape(SAMPLES, FRAMES, -1)) @ rng.normal(size=(3 * JOINTS, 7))


@pytest.fixture(params=COVARIANCES)
def own(request, points, positions, values):
    return naive_kriging.fit_naive(points, positions, values, request.param, variogram.fit_by_grid)


@pytest.mark.parametrize("form", ["onnx", "onnx_dual"])
def test_graph_answers_what_numpy_does(own, form, rng):
    worst, other = 0.0, 0.0
    for point in rng.uniform(-1.2, 1.2, size=(6, 1, 3)).astype(np.float32).astype(float):
        (found,) = outputs(getattr(own, form), (2,), point=point)
        expected = own.numpy(point)[0]
        assert found.shape == (FRAMES, 7)
        worst = max(worst, np.max(np.abs(found - expected)))
        other = max(other, np.max(np.abs(found - own.numpy(point + 0.02)[0])))
    # float32 through an inverse of condition 1e4.
    assert worst < 2e-3
    assert other > 6e-3


def test_frame_is_what_scipy_interpolates(points, positions, values, rng):
    own = naive_kriging.fit_naive(points, positions, values, "gaussian", variogram.fit_by_grid)
    asked = rng.uniform(-1.0, 1.0, size=(9, 3))
    found = own.numpy(asked)
    for frame, field in enumerate(own.fields):
        # exp(-(εr)²) there, exp(-3 (sr)²) here.
        given = {"kernel": "gaussian", "epsilon": np.sqrt(3.0) * field.hyper.scales[0], "degree": 1}
        expected = RBFInterpolator(points, values[:, frame], smoothing=field.hyper.nugget, **given)(
            asked
        )
        assert np.max(np.abs(found[:, frame] - expected)) < 1e-8
        exact = RBFInterpolator(points, values[:, frame], smoothing=1e-9, **given)(asked)
        assert np.max(np.abs(found[:, frame] - exact)) > 1e-4
