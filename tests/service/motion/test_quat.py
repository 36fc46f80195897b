"""Tests of unit quaternions: properties of rotations."""

from itertools import permutations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from posefield.motion import quat

# A few roundings of numbers of size one.
TOLERANCE = 1e-12
ORDERS = ["".join(order) for order in permutations("XYZ")]


def near(a, b):
    return np.max(np.abs(a - b)) < TOLERANCE


@pytest.fixture
def turns(rng):
    return quat.normalize(rng.normal(size=(50, 4)))


@pytest.fixture
def vectors(rng):
    return rng.normal(size=(50, 3))


def test_product_turns_by_the_second_first(rng, turns, vectors):
    other = quat.normalize(rng.normal(size=(50, 4)))
    twice = quat.rotate(turns, quat.rotate(other, vectors))
    assert near(quat.rotate(quat.mul(turns, other), vectors), twice)
    assert not near(quat.rotate(quat.mul(other, turns), vectors), twice)


def test_quaternion_and_its_negative_turn_alike(turns, vectors):
    assert near(quat.rotate(-turns, vectors), quat.rotate(turns, vectors))
    assert near(quat.log(-turns), quat.log(turns))
    assert near(quat.to_matrix(-turns), quat.to_matrix(turns))
    assert not near(quat.rotate(quat.conj(turns), vectors), quat.rotate(turns, vectors))


@settings(derandomize=True, database=None, max_examples=200)
@given(arrays(float, 3, elements=st.floats(-1.8, 1.8)))
def test_logarithm_undoes_the_exponential_within_half_a_turn(vector):
    found = quat.log(quat.exp(vector))
    # 1.8 √3 is just short of π; there the angle is known to a rounding of its half's sine.
    assert np.max(np.abs(found - vector)) < 1e-11


def test_logarithm_takes_the_shorter_turn():
    long_way = np.array([0.0, 1.5 * np.pi, 0.0])
    assert near(quat.log(quat.exp(long_way)), np.array([0.0, -0.5 * np.pi, 0.0]))


def test_slerp_meets_both_ends_at_an_even_pace(rng, turns):
    other = quat.normalize(rng.normal(size=(50, 4)))
    shares = np.linspace(0.0, 1.0, 5)[:, None]
    way = quat.slerp(turns, other, shares)
    steps = np.linalg.norm(quat.log(quat.mul(quat.conj(way[:-1]), way[1:])), axis=-1)
    assert near(quat.to_matrix(way[0]), quat.to_matrix(turns))
    assert near(quat.to_matrix(way[-1]), quat.to_matrix(other))
    assert near(steps, steps[:1])
    straight = quat.normalize((1.0 - shares[..., None]) * turns + shares[..., None] * other)
    uneven = np.linalg.norm(quat.log(quat.mul(quat.conj(straight[:-1]), straight[1:])), axis=-1)
    assert not near(uneven, uneven[:1])


def test_unrolled_rotations_are_the_same_and_lie_close(rng):
    path = np.stack(
        [quat.from_axis_angle(np.eye(3)[i % 3], np.linspace(0, 7, 60)) for i in range(4)], axis=1
    )
    signs = rng.choice([-1.0, 1.0], size=(60, 4, 1))
    unrolled = quat.unroll(path * signs)
    assert np.min(np.sum(unrolled[1:] * unrolled[:-1], axis=-1)) > 0.9
    assert np.min(np.sum((path * signs)[1:] * (path * signs)[:-1], axis=-1)) < -0.9
    assert near(quat.to_matrix(unrolled), quat.to_matrix(path))
    assert np.array_equal(unrolled[0], (path * signs)[0])


def test_mean_turns_with_what_is_averaged(rng, turns):
    spread = quat.mul(turns[:1], quat.exp(0.3 * rng.normal(size=(40, 1, 3))))
    turned = quat.to_matrix(quat.mean(quat.mul(turns[1], spread)))
    assert near(turned, quat.to_matrix(quat.mul(turns[1], quat.mean(spread))))
    assert not near(turned, quat.to_matrix(quat.mean(spread)))


@pytest.mark.parametrize("axis", np.eye(3), ids=list("XYZ"))
def test_twist_is_the_angle_about_the_axis_within_half_a_turn(axis):
    angles = np.linspace(-9.0, 9.0, 37)
    wrapped = np.arctan2(np.sin(angles), np.cos(angles))
    assert near(quat.twist(quat.from_axis_angle(axis, angles), axis), wrapped)
    assert near(quat.twist(-quat.from_axis_angle(axis, angles), axis), wrapped)
    assert not near(quat.twist(quat.from_axis_angle(axis, angles), axis), angles)


def test_twist_leaves_out_a_swing(rng):
    swing = quat.exp(np.stack([rng.normal(size=20), np.zeros(20), rng.normal(size=20)], axis=-1))
    up, angles = np.array([0.0, 1.0, 0.0]), np.linspace(-3.0, 3.0, 20)
    assert near(quat.twist(quat.mul(swing, quat.from_axis_angle(up, angles)), up), angles)


def test_matrices_are_rotations(turns, vectors):
    matrices = quat.to_matrix(turns)
    assert near(matrices @ matrices.swapaxes(-1, -2), np.eye(3))
    assert near(np.linalg.det(matrices), np.ones(50))
    assert near((matrices @ vectors[..., None])[..., 0], quat.rotate(turns, vectors))
    assert not near((vectors[:, None] @ matrices)[:, 0], quat.rotate(turns, vectors))


def test_matrix_leads_back_to_its_quaternion_at_every_largest_component(turns):
    half_turns = np.concatenate([np.eye(4), quat.normalize(np.eye(4) + 0.01)])
    for q in (turns, half_turns):
        back = quat.from_matrix(quat.to_matrix(q))
        assert near(np.abs(np.sum(back * q, axis=-1)), np.ones(len(q)))
        assert np.all(back[:, 0] >= 0)


@pytest.mark.parametrize("order", ORDERS)
def test_euler_angles_lead_back_to_themselves(order, rng):
    angles = rng.uniform([-3.1, -1.5, -3.1], [3.1, 1.5, 3.1], size=(50, 3))
    back = quat.to_euler(quat.from_euler(angles, order), order)
    # Near a quarter turn the outer angles lose digits as the cosine of the middle one.
    assert np.max(np.abs(back - angles)) < 1e-10
    other = quat.to_euler(quat.from_euler(angles, order), order[::-1])
    assert np.max(np.abs(other - angles)) > 1e-2


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("middle", [-np.pi / 2, np.pi / 2])
def test_locked_euler_angles_mean_the_same_rotation_and_end_in_zero(order, middle, rng):
    angles = rng.uniform(-3.0, 3.0, size=(50, 3))
    angles[:, 1] = middle
    q = quat.from_euler(angles, order)
    found = quat.to_euler(q, order)
    again = quat.from_euler(found, order)
    # The middle angle is an arcsine at one, where a rounding of 1e-16 is an angle of 1e-8.
    assert np.max(np.abs(quat.to_matrix(again) - quat.to_matrix(q))) < 1e-7
    assert np.array_equal(found[:, 2], np.zeros(50))
    dropped = quat.from_euler(angles * [1.0, 1.0, 0.0], order)
    assert np.max(np.abs(quat.to_matrix(dropped) - quat.to_matrix(q))) > 1e-2


# Of one quaternion alone components are single numbers, which NumPy cannot write to.
@pytest.mark.parametrize("count", [(), (7, 5)])
def test_products_and_turned_vectors_of_planes_have_the_same_bits(rng, count):
    one, other = quat.normalize(rng.normal(size=(2, *count, 4)))
    vectors = rng.normal(size=(*count, 3))
    planes = [np.moveaxis(values, -1, 0).copy() for values in (one, other, vectors)]
    both, turned = np.empty((4, *count)), np.empty((3, *count))
    quat.product_planes(planes[0], planes[1], out=both)
    quat.rotate_planes(planes[0], planes[2], out=turned)
    assert np.array_equal(np.moveaxis(both, 0, -1), quat.mul(one, other))
    assert np.array_equal(np.moveaxis(turned, 0, -1), quat.rotate(one, vectors))
    assert not np.array_equal(np.moveaxis(both, 0, -1), quat.mul(other, one))
