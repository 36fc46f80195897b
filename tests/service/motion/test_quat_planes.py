"""Tests of quaternions as planes: equal to quaternions in the last axis."""

import numpy as np
import pytest

from posefield.motion import quat, quat_planes


@pytest.fixture
def turns(rng):
    return quat.normalize(rng.normal(size=(2, 7, 5, 4)))


@pytest.fixture
def vectors(rng):
    # Zero and a half turn too, where the sine over the angle is zero over zero and zero.
    vectors = rng.normal(size=(7, 5, 3))
    vectors[0] = 0.0
    vectors[1] *= np.pi / np.linalg.norm(vectors[1], axis=-1, keepdims=True)
    return vectors


def planes(values):
    """Values (..., k) as planes (k, ...)."""
    return np.ascontiguousarray(np.moveaxis(values, -1, 0))


def same(found, expected):
    return np.array_equal(found, planes(expected))


def test_product_has_the_same_bits(turns):
    a, b = turns
    found = np.empty((4, 7, 5))
    quat_planes.product(planes(a), planes(b), out=found)
    assert same(found, quat.mul(a, b))
    assert not same(found, quat.mul(b, a))


def test_turned_vectors_have_the_same_bits(turns, vectors):
    found = np.empty((3, 7, 5))
    quat_planes.rotate(planes(turns[0]), planes(vectors), out=found)
    assert same(found, quat.rotate(turns[0], vectors))
    assert not same(found, quat.rotate(turns[1], vectors))


def test_one_quaternion_alone_has_the_same_bits(turns, vectors):
    """Components are then single numbers, which NumPy cannot write to."""
    turned, both = np.empty(3), np.empty(4)
    quat_planes.rotate(turns[0, 2, 2], vectors[2, 2], out=turned)
    quat_planes.product(turns[0, 2, 2], turns[1, 2, 2], out=both)
    assert np.array_equal(turned, quat.rotate(turns[0, 2, 2], vectors[2, 2]))
    assert np.array_equal(both, quat.mul(turns[0, 2, 2], turns[1, 2, 2]))
