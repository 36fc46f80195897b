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


@pytest.mark.parametrize("turn", [-2.0, 0.0, 1e-9, 0.4])
def test_straightened_undoes_it(turn):
    way = np.array(0.8 - 0.2j)
    gap = floor_plane.arc_displacement(way, np.array(turn))
    assert abs(floor_plane.inverse_arc(gap, np.array(turn)) - way) < ROUNDING
