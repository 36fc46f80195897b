"""Tests of crowds that keep their distances."""

import numpy as np
import pytest

from posefield.inference import session
from posefield.locomotion import collision_avoidance, gait, walking_crowd
from posefield.question.walk_question import WalkQuestion
from posefield.synthesis import walking_feet
from posefield.synthesis.synthesizer import Synthesizer

RATE = 30.0


@pytest.fixture(scope="module")
def model(walk_path):
    return Synthesizer("stroll", session.load(walk_path))


@pytest.fixture(scope="module")
def own(model):
    return gait.fit_gait(model.session)


def nearest(places):
    """The smallest distance of two characters in any frame, m."""
    apart = np.abs(places[:, None] - places) + 9.0 * np.eye(len(places))[..., None]
    return apart.min()


@pytest.mark.parametrize("seed", [0, 1])
def test_fifty_walkers_do_not_walk_through_each_other(own, seed):
    plan = walking_crowd.plan_random(own, 50, 20.0, RATE, seed)
    assert nearest(plan.places) > 2.0 * collision_avoidance.RADIUS
    # Each walker still gets on: none stands or walks in circles.
    assert np.abs(plan.places[:, -1] - plan.places[:, 0]).min() > 5.0
    # Negative control: with the walkers of another crowd, which were planned without these.
    others = walking_crowd.plan_random(own, 50, 20.0, RATE, seed + 10)
    both = np.concatenate([plan.places, others.places])
    assert nearest(both) < 0.3
    assert len(collision_avoidance.find_overlaps(both, RATE)) > 10


def test_overlaps_are_those_of_all_pairs(rng):
    places = np.cumsum(rng.normal(size=(40, 90)) + 1j * rng.normal(size=(40, 90)), axis=1)
    expected = {}
    for first, second in zip(*np.triu_indices(40, 1), strict=True):
        near = np.abs(places[first] - places[second])[::3] < 0.5
        if near.any():
            expected[int(first), int(second)] = int(near.argmax()) * 3 / RATE
    found = collision_avoidance.find_overlaps(places, RATE)
    assert {(one.first, one.second): one.seconds for one in found} == expected
    assert len(expected) > 20
    assert [one.seconds for one in found] == sorted(one.seconds for one in found)


def test_neighbours_begin_at_different_phases(own):
    drawn = collision_avoidance.draw_characters(own, 100, 3)
    grid = np.stack(collision_avoidance.grid_cells(100))
    beside = np.abs(grid[:, :, None] - grid[:, None]).max(axis=0) == 1
    gaps = np.abs(drawn.phases[:, None] - drawn.phases)[beside]
    assert np.minimum(gaps, 1.0 - gaps).min() >= 0.1 - 1e-9
    assert np.histogram(drawn.phases, 5, (0.0, 1.0))[0].min() >= 15


def test_overlaps_of_shared_motions_are_told(model, own):
    order = WalkQuestion(count=40, motions=3, seconds=10.0)
    found = walking_feet.build_crowd(model, own, order).facts["overlaps"]
    assert found["pairs"] > 10 and len(found["seconds"]) <= walking_crowd.MOST_OVERLAPS
