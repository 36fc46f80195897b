"""Tests of the paths of walks: curves to a place, ways around discs, and speeds along them."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from posefield.locomotion import floor_plane
from posefield.performance import walk_paths, walk_request
from posefield.performance.passage import RATE, FloorMotion
from posefield.performance.walk_paths import Radii
from posefield.performance.walk_request import Disc, SpeedRamps

ROLLING, STANDING = SpeedRamps(None, None), SpeedRamps(0.0, 0.0)
angles = st.floats(-3.1, 3.1)


@given(turn=angles, bearing=angles, heading=st.none() | angles, away=st.floats(8.0, 30.0))
def test_curves_end_where_they_should_and_keep_to_their_radii(turn, bearing, heading, away):
    start, radii = FloorMotion(turn, 1.0 - 2.0j), Radii(2.0, 3.0)
    place = start.shift + away * np.exp(1j * bearing)
    path = walk_paths.connect(start, complex(place), heading, radii)
    assert path.start == start.shift
    assert abs(path.end - place) < 1e-3
    assert path.headings[0] == pytest.approx(turn, abs=1e-6)
    if heading is not None:
        assert abs(np.exp(1j * path.headings[-1]) - np.exp(1j * heading)) < 1e-6
    assert radii.allow(path.curvatures / 1.001)
    assert path.length >= away - 1e-3


def test_there_is_no_room_to_turn_within_a_circle():
    with pytest.raises(ValueError, match="no curve"):
        walk_paths.connect(FloorMotion(), 0.5j, None, Radii(3.0, 3.0))


def test_a_spline_begins_and_ends_with_given_slopes():
    knots = np.array([0.0, 2.0, 5.0])
    # A cubic polynomial is its own spline.
    cubic = np.column_stack([knots**3 - knots, knots**2])
    slopes = np.column_stack([3.0 * knots**2 - 1.0, 2.0 * knots])
    at = np.linspace(0.0, 5.0, 11)
    points, found = floor_plane.spline(knots, cubic, at, (slopes[0], slopes[-1]))
    assert np.allclose(points, np.column_stack([at**3 - at, at**2]))
    assert np.allclose(found[[0, -1]], slopes[[0, -1]])
    free = floor_plane.spline(knots, cubic, at, (None, None))[1]
    assert not np.allclose(free[[0, -1]], slopes[[0, -1]], atol=0.1)


def test_the_way_around_a_disc_is_nearly_the_shortest():
    corners = walk_request.way_around(0j, 10.0 + 0j, [Disc(0.0, 5.0, 1.0)], 0.0)
    way = np.array([0j, *corners, 10.0 + 0j])
    # A smaller disc with a clearance leads as far around.
    spared = walk_request.way_around(0j, 10.0 + 0j, [Disc(0.0, 5.0, 0.7)], 0.3)
    assert spared == pytest.approx(corners)
    # Two tangents and an arc.
    tangent, arc = np.sqrt(24.0), np.arcsin(0.2)
    assert np.abs(np.diff(way)).sum() == pytest.approx(2.0 * (tangent + arc), rel=0.01)
    at = way[0] + np.concatenate([np.linspace(a, b, 50) for a, b in itertools.pairwise(way)])
    assert np.abs(at - 5.0).min() > 0.99


def test_there_is_no_way_out_of_a_ring_of_discs():
    around = np.linspace(0.0, 2.0 * np.pi, 13)
    ring = [Disc(float(3.0 * np.sin(a)), float(3.0 * np.cos(a)), 0.9) for a in around]
    assert walk_request.way_around(0j, 10.0 + 0j, ring, 0.1) is None
    assert walk_request.way_around(0j, 10.0 + 0j, ring[2:], 0.1)


@given(
    speeds=st.lists(st.floats(0.5, 1.8), min_size=1, max_size=4),
    length=st.floats(1.0, 30.0),
    scale=st.sampled_from(["distance", "time"]),
    standing=st.booleans(),
)
def test_distances_reach_the_length_and_never_go_back(speeds, length, scale, standing):
    curve = 4.0 * np.arange(len(speeds)), np.array(speeds)
    ramps = STANDING if standing else ROLLING
    gone = walk_request.distances_over_length(curve, scale, length, ramps)
    assert gone[0] == 0.0
    assert gone[-1] == pytest.approx(length)
    assert np.all(np.diff(gone) > -1e-12)
    assert np.diff(gone).max() * RATE < 1.02 * max(speeds) + 0.01


def test_an_even_acceleration_takes_the_time_of_mechanics():
    curve = np.zeros(1), np.array([1.2])
    gone = walk_request.distances_over_length(curve, "distance", 20.0, STANDING)
    # Two ramps of 3 s and 1.8 m each.
    assert (len(gone) - 1) / RATE == pytest.approx(6.0 + 16.4 / 1.2, abs=1.0 / RATE)
    times = np.arange(120) / RATE
    assert gone[:120] == pytest.approx(0.2 * times**2, abs=2e-3)
    rolled = walk_request.distances_over_length(curve, "distance", 20.0, ROLLING)
    assert (len(rolled) - 1) / RATE == pytest.approx(20.0 / 1.2, abs=1.0 / RATE)
