"""Tests of paths over the floor: through waypoints, or random from a seed."""

import numpy as np
import pytest

from posefield.inference import session
from posefield.locomotion import collision_avoidance, floor_plane, gait
from posefield.locomotion.locomotion_plan import POINT_SPACING, Paths


@pytest.fixture(scope="module")
def own(walk_path):
    return gait.fit_gait(session.load(walk_path))


def circle(radius):
    """One way round a circle, to the left."""
    headings = np.arange(200) * POINT_SPACING / radius
    starts = np.zeros(1, dtype=np.complex128)
    return Paths(starts, headings[None], np.ones((1, 200)))


def test_even_turns_are_a_circle_between_places_too():
    ways = circle(2.0)
    places, tangents = ways.at(np.linspace(0.0, 15.0, 333)[None])
    # Its middle lies to the left, which is imaginary.
    assert np.abs(np.abs(places - 2.0j) - 2.0).max() < 1e-12
    assert tangents[0, -1] == pytest.approx(7.5)
    assert ways.curvatures == pytest.approx(0.5)


def test_characters_that_wander_stay_within_what_was_sampled(own):
    ways = collision_avoidance.draw_paths(
        own, collision_avoidance.draw_characters(own, 200, 1), 10.0
    )
    turning = ways.speeds * ways.curvatures
    assert own.region.contains(ways.speeds, turning).all()
    # They do turn, and change their speed.
    assert np.ptp(ways.headings, axis=1).min() > 0.1
    assert np.mean(np.ptp(ways.speeds, axis=1) > 0.02) > 0.95


def test_nobody_begins_within_a_metre_of_another_however_many(own):
    for count in (2, 50, 701):
        ways = collision_avoidance.draw_paths(
            own, collision_avoidance.draw_characters(own, count, 5), 1.0
        )
        apart = np.abs(ways.starts[:, None] - ways.starts) + 9.0 * np.eye(count)
        assert apart.min() >= 1.0
    side = np.ptp(ways.starts.real)
    assert side == pytest.approx(2.0 * np.sqrt(701), rel=0.1)


def test_a_character_hangs_on_its_number_and_the_seed_alone(own):
    few, many = (collision_avoidance.draw_characters(own, count, 7) for count in (5, 10))
    assert np.array_equal(few.who, many.who[:5])
    assert np.array_equal(few.random_numbers, many.random_numbers[:5])
    assert set(collision_avoidance.draw_characters(own, 50, 7).who) == {0, 1}
    of_few, of_many = (collision_avoidance.draw_paths(own, some, 4.0) for some in (few, many))
    assert np.array_equal(of_few.starts, of_many.starts[:5])
    assert np.array_equal(of_few.headings, of_many.headings[:5])
    assert not np.array_equal(
        collision_avoidance.draw_characters(own, 5, 8).random_numbers, few.random_numbers
    )


ROUNDING = 1e-12


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
