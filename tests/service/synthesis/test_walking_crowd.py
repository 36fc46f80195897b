"""Tests of walking crowds: reproducible from a seed, generated in batches."""

import re

import numpy as np
import pytest

from posefield.common.errors import InvalidField
from posefield.inference import session
from posefield.locomotion import (
    floor_plane,
    gait,
    level_transitions,
    locomotion_plan,
    walking_crowd,
)
from posefield.motion import quat

RATE = 30.0


@pytest.fixture(scope="module")
def own(walk_path):
    return gait.fit_gait(session.load(walk_path))


def made(own, count, seed=3, seconds=1.0):
    """A crowd that wanders, and its motions."""
    plan = walking_crowd.plan_random(own, count, seconds, RATE, seed)
    crowd = walking_crowd.build_crowd(
        own.session, plan, level_transitions.constant_schedule(0, plan.phases.shape)
    )
    return crowd, list(crowd.batches)


def joined(motions, part):
    return np.concatenate([getattr(one, part) for one in motions])


PARTS = ("rotations", "root_position", "bone_offsets", "levels")


def test_the_same_seed_gives_the_same_bytes_and_another_others(own):
    once, again, other = (made(own, 6, seed)[1] for seed in (3, 3, 4))
    for part in PARTS:
        assert np.array_equal(joined(once, part), joined(again, part))
    assert not np.array_equal(joined(once, "rotations"), joined(other, "rotations"))


def test_fewer_characters_are_the_first_of_more(own):
    few, many = made(own, 5), made(own, 10)
    assert np.array_equal(few[0].placement.positions, many[0].placement.positions[:5])
    for part in PARTS:
        # The runtime's sums may go in another order in a batch of another size.
        gap = np.abs(joined(few[1], part) - joined(many[1], part)[:5])
        assert gap.max() < 2e-6
    assert few[0].facts["performers"] == many[0].facts["performers"][:5]


def test_a_motion_begins_at_home_and_its_placement_puts_it_in_the_world(own):
    plan = walking_crowd.plan_random(own, 4, 2.0, RATE, 0)
    crowd = walking_crowd.build_crowd(
        own.session, plan, level_transitions.constant_schedule(0, plan.phases.shape)
    )
    motions = next(iter(crowd.batches))
    at_home = motions.root_position[:, 0] * [1.0, 0.0, 1.0]
    # A pelvis sways about the way, no farther.
    assert np.abs(at_home).max() < 0.1
    who, frames = np.repeat(np.arange(4), 61), np.tile(np.arange(61), 4)
    posed = locomotion_plan.synthesize_poses(own.session, plan, who, frames)
    turns = crowd.placement.turns[:, None]
    roots = quat.rotate(turns, motions.root_position) + crowd.placement.positions[:, None]
    expected = floor_plane.at_height(posed.places, posed.heights).reshape(4, 61, 3)
    assert np.abs(roots - expected).max() < 1e-5
    turned = quat.mul(turns, motions.rotations[:, :, 0]).reshape(-1, 4)
    assert np.abs(turned - posed.rotations[:, 0]).max() < 1e-5
    assert (
        np.abs(posed.rotations[:, 1:] - motions.rotations[:, :, 1:].reshape(-1, 6, 4)).max() < 1e-6
    )


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ((0, 1.0, RATE, 0), "count: 0, expected at least 1"),
        ((5, np.inf, RATE, 0), "seconds: inf, expected"),
        ((5, 1.0, 0.0, 0), "fps: 0, expected 1 to 1000"),
        ((5, 1.0, RATE, -1), "seed: -1, expected 0 to less than"),
        ((10**6, 10.0, RATE, 0), "count: 3.01e+08 poses, expected 20000000"),
    ],
)
def test_numbers_that_make_no_crowd_are_refused(own, asked, said):
    with pytest.raises(InvalidField, match=re.escape(said)):
        walking_crowd.plan_random(own, *asked)
