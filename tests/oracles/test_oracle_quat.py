"""Comparison of quaternion functions with scipy.spatial.transform."""

from itertools import permutations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from posefield.motion import quat

TOLERANCE = 1e-12
ORDERS = ["".join(order) for order in permutations("XYZ")]


@pytest.fixture
def turns(rng):
    return quat.normalize(rng.normal(size=(60, 4)))


def theirs(q):
    return Rotation.from_quat(q, scalar_first=True)


def same(q, rotation):
    """Return whether quaternions equal SciPy's rotations."""
    return np.max(np.abs(quat.to_matrix(q) - rotation.as_matrix())) < TOLERANCE


def test_matrices(turns):
    assert same(turns, theirs(turns))
    assert not same(turns, theirs(turns).inv())
    assert same(quat.from_matrix(theirs(turns).as_matrix()), theirs(turns))


def test_products(turns):
    assert same(quat.mul(turns, turns[::-1]), theirs(turns) * theirs(turns[::-1]))
    assert not same(quat.mul(turns, turns[::-1]), theirs(turns[::-1]) * theirs(turns))


def test_turned_vectors(turns, rng):
    vectors = rng.normal(size=(60, 3))
    found = quat.rotate(turns, vectors)
    assert np.max(np.abs(found - theirs(turns).apply(vectors))) < TOLERANCE
    assert np.max(np.abs(found - theirs(turns).apply(vectors, inverse=True))) > 0.1


def test_exponentials_and_logarithms(turns, rng):
    vectors = rng.normal(scale=3.0, size=(60, 3))
    assert same(quat.exp(vectors), Rotation.from_rotvec(vectors))
    assert not same(quat.exp(0.5 * vectors), Rotation.from_rotvec(vectors))
    assert np.max(np.abs(quat.log(turns) - theirs(turns).as_rotvec())) < TOLERANCE
    assert np.max(np.abs(2.0 * turns[:, 1:] - theirs(turns).as_rotvec())) > 0.1


def test_slerp(turns):
    for a, b in zip(turns[:10], turns[10:20], strict=True):
        shares = np.linspace(0.0, 1.0, 7)
        expected = Slerp([0.0, 1.0], theirs(np.stack([a, b])))
        assert same(quat.slerp(a, b, shares), expected(shares))
        assert not same(quat.slerp(a, b, shares**2), expected(shares))


def test_means(turns, rng):
    spread = quat.mul(turns[0], quat.exp(0.5 * rng.normal(size=(40, 3))))
    found = quat.mean(spread[:, None])
    assert np.max(np.abs(quat.to_matrix(found[0]) - theirs(spread).mean().as_matrix())) < TOLERANCE
    one_less = theirs(spread[:39]).mean().as_matrix()
    assert np.max(np.abs(quat.to_matrix(found[0]) - one_less)) > 1e-3


@pytest.mark.parametrize("order", ORDERS)
def test_euler_angles(order, turns, rng):
    angles = rng.uniform(-3.0, 3.0, size=(60, 3))
    found = quat.from_euler(angles, order)
    # SciPy's capitals turn about moving axes, its small letters about fixed ones.
    assert same(found, Rotation.from_euler(order, angles))
    assert not same(found, Rotation.from_euler(order.lower(), angles))
    back = quat.to_euler(turns, order)
    assert np.max(np.abs(back - theirs(turns).as_euler(order))) < 1e-10
    assert np.max(np.abs(back - theirs(turns).as_euler(order.lower()))) > 0.1


@pytest.mark.parametrize("name", ["X", "ZY", "YXZ"])
def test_euler_angles_of_one_to_three_axes(name, rng):
    angles = rng.uniform(-3.0, 3.0, size=(20, len(name)))
    assert same(quat.from_euler(angles, name), Rotation.from_euler(name, angles))
