"""Tests of the floor as the complex plane: arcs are the exponential map of rigid motion."""

import numpy as np
import pytest

from posefield.common.units import UP
from posefield.locomotion import floor_plane
from posefield.motion import quat

ROUNDING = 1e-12


def test_a_heading_turns_as_the_quaternion_does(rng):
    points = rng.normal(size=(20, 3)) * (1.0 - UP)
    headings = rng.uniform(-4.0, 4.0, 20)
    expected = quat.rotate(quat.from_axis_angle(UP, headings), points)
    found = floor_plane.at_height(
        floor_plane.project(points) * floor_plane.unit_vectors(headings), np.zeros(20)
    )
    assert np.abs(found - expected).max() < ROUNDING


def test_an_arc_is_many_small_steps():
    way, turn, steps = 1.2 + 0.1j, 0.9, 200_000
    headings = (np.arange(steps) + 0.5) / steps * turn
    expected = np.sum(way / steps * np.exp(1j * headings))
    assert abs(floor_plane.arc_displacement(np.array(way), np.array(turn)) - expected) < 1e-10


def test_an_arc_in_two_parts_is_the_arc():
    way, turn = np.array(1.2 + 0.1j), np.array(0.9)
    half = floor_plane.arc_displacement(0.3 * way, 0.3 * turn)
    rest = floor_plane.arc_displacement(0.7 * way, 0.7 * turn) * floor_plane.unit_vectors(
        0.3 * turn
    )
    assert abs(half + rest - floor_plane.arc_displacement(way, turn)) < ROUNDING


@pytest.mark.parametrize("turn", [-2.0, 0.0, 1e-9, 0.4])
def test_straightened_undoes_it(turn):
    way = np.array(0.8 - 0.2j)
    gap = floor_plane.arc_displacement(way, np.array(turn))
    assert abs(floor_plane.inverse_arc(gap, np.array(turn)) - way) < ROUNDING


def test_only_the_root_is_turned(rng):
    rotations = quat.normalize(rng.normal(size=(5, 3, 4)))
    turned = floor_plane.turn_roots(rotations, rng.uniform(-1.0, 1.0, 5))
    assert np.array_equal(turned[:, 1:], rotations[:, 1:])
    assert np.abs(turned[:, 0] - rotations[:, 0]).max() > 0.1
