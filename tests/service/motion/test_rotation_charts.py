"""Tests of charts of rotations: against quaternions, differences and SciPy."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from posefield.motion import quat
from posefield.motion.quat import CHARTS

EXACT = 1e-12


@pytest.fixture(params=CHARTS)
def chart(request):
    return CHARTS[request.param]


@pytest.fixture
def vectors(rng):
    """Rotation vectors (40, 3) of up to 1.8 half turns, and none."""
    axes = quat.normalize(rng.normal(size=(40, 4)))[:, 1:]
    axes /= np.linalg.norm(axes, axis=-1, keepdims=True)
    return axes * np.linspace(0.0, 1.8 * np.pi, 40)[:, None]


def test_numbers_of_rotations_give_them_back(chart, vectors):
    found = chart.quaternions(chart.numbers(vectors))
    assert np.abs(found - quat.exp(vectors)).max() < EXACT
    assert np.abs(np.linalg.norm(found, axis=-1) - 1.0).max() < EXACT
    # Negative control: a hundredth of a degree.
    moved = chart.quaternions(chart.numbers(vectors + np.radians(0.01)))
    assert np.abs(moved - quat.exp(vectors)).max() > 1e-5


def test_stereographic_numbers_are_scipy_s_modified_rodrigues_parameters(vectors):
    short = vectors[np.linalg.norm(vectors, axis=-1) < np.pi]
    found = CHARTS["stereographic"].numbers(short)
    assert np.abs(found - 4.0 * Rotation.from_rotvec(short).as_mrp()).max() < EXACT


def test_planes_have_the_numbers_of_quaternions(chart, vectors):
    numbers = chart.numbers(vectors)
    planes = chart.planes(np.ascontiguousarray(numbers.T))
    assert np.abs(planes.T - chart.quaternions(numbers)).max() < EXACT
    assert chart.planes(numbers[7]).shape == (4,)


def test_jacobian_is_that_of_differences(chart, vectors):
    numbers, step = chart.numbers(vectors), 1e-5
    columns = []
    for axis in np.eye(3):
        ahead, behind = (chart.quaternions(numbers + s * step * axis) for s in (1.0, -1.0))
        columns.append(quat.log(quat.mul(quat.conj(behind), ahead)) / (2.0 * step))
    found = chart.right_jacobian(numbers)
    assert np.abs(found - np.stack(columns, axis=-1)).max() < 1e-8
    # Negative control: a transposed matrix turns the other way.
    assert np.abs(found.swapaxes(-1, -2) - np.stack(columns, axis=-1)).max() > 0.1


def test_factors_of_the_mean_product_give_the_product(chart, vectors, rng):
    """mean q = mean c + (mean s v) k, on which decoders rely."""
    mean, numbers = quat.normalize(rng.normal(size=4)), chart.numbers(vectors)
    turned = quat.mul(mean, np.pad(chart.share * numbers, ((0, 0), (1, 0))))
    real, factor = chart.terms(np.sum(np.square(turned), axis=-1, keepdims=True))
    expected = quat.mul(mean, quat.exp(vectors))
    assert np.abs(mean * real + turned * factor - expected).max() < EXACT
