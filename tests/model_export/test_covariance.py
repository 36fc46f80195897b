"""Tests of all covariance functions: NumPy against ONNX, and their mathematical properties."""

import numpy as np
import pytest
from running import outputs
from scipy.special import gamma, kv

from posefield_train.kriging.kriging_graph import COVARIANCES

# float32 has seven digits, and the longest form takes six operations.
FLOAT32 = 2e-6
SQUARED = np.square(np.concatenate([[0.0], np.geomspace(1e-4, 3.0, 200)]))


@pytest.fixture(params=COVARIANCES)
def name(request):
    return request.param


def test_graph_answers_what_numpy_does(name):
    covariance = COVARIANCES[name]
    (found,) = outputs(covariance.onnx, (1,), scaled=covariance.gain * SQUARED)
    assert np.max(np.abs(found - covariance.numpy(SQUARED))) < FLOAT32
    assert np.max(np.abs(found - covariance.numpy(np.sqrt(SQUARED)))) > 1e-2
    for other in set(COVARIANCES) - {name}:
        assert np.max(np.abs(found - COVARIANCES[other].numpy(SQUARED))) > 1e-2


def test_sill_is_one_and_five_per_cent_are_left_at_the_range(name):
    at_nothing, at_range = COVARIANCES[name].numpy(np.array([0.0, 1.0]))
    assert at_nothing == 1.0
    left = 0.0 if name == "spherical" else 0.05
    # e⁻³ is 4.98 %.
    assert abs(at_range - left) < 3e-4
    assert abs(COVARIANCES[name].numpy(np.array([0.9]))[0] - left) > 3e-4


def test_matrix_of_covariances_is_positive_definite(name, rng):
    # The spherical one is valid in three dimensions and no more.
    points = rng.uniform(-1.0, 1.0, size=(80, 3))
    squared = np.sum(np.square(points[:, None] - points), axis=-1)
    assert np.linalg.eigvalsh(COVARIANCES[name].numpy(squared))[0] > -1e-12
    box = np.where(squared < 1.0, 1.0, 0.0)
    assert np.linalg.eigvalsh(box)[0] < -1e-1


@pytest.mark.parametrize(
    ("name", "order", "rate"), [("matern32", 1.5, 4.743865), ("matern52", 2.5, 5.918277)]
)
def test_matern_is_the_bessel_function_of_its_order(name, order, rate):
    a = rate * np.sqrt(SQUARED[1:])

    def bessel(order):
        return 2.0 ** (1.0 - order) / gamma(order) * a**order * kv(order, a)

    found = COVARIANCES[name].numpy(SQUARED[1:])
    assert np.max(np.abs(found - bessel(order))) < 1e-12
    assert np.max(np.abs(found - bessel(order + 1.0))) > 1e-2


def test_exponential_is_the_matern_of_one_half():
    a = 3.0 * np.sqrt(SQUARED[1:])
    bessel = 2.0**0.5 / gamma(0.5) * np.sqrt(a) * kv(0.5, a)
    assert np.max(np.abs(COVARIANCES["exponential"].numpy(SQUARED[1:]) - bessel)) < 1e-12
