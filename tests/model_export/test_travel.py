"""Tests of travel: the displacement of a cycle is removed and restored."""

import numpy as np

from posefield.common.units import UP
from posefield.motion import quat
from posefield_train.align import travel
from posefield_train.align.time_alignment import AlignedClips

ROUNDING = 1e-12


def cycles(rng):
    """Three clips that close but for the way they go and the heading they end in."""
    share = np.linspace(0.0, 1.0, 20)
    swing = np.sin(2 * np.pi * share)[None, :, None, None] * rng.normal(size=(3, 1, 4, 3))
    rotations = quat.exp(0.3 * swing)
    turns = np.array([-0.4, 0.0, 0.9])
    rotations[:, :, 0] = quat.mul(
        quat.from_axis_angle(UP, turns[:, None] * share), rotations[:, :, 0]
    )
    ways = rng.normal(size=(3, 2))
    path = 0.1 * np.cos(2 * np.pi * share)[:, None] * np.ones((3, 1, 3))
    path[..., [0, 2]] += share[:, None] * ways[:, None]
    aligned = AlignedClips(rotations, path, np.zeros((3, 6)), np.ones(3), 0)
    return aligned, np.column_stack([ways, turns])


def test_travel_is_found_and_what_is_left_closes(rng):
    aligned, expected = cycles(rng)
    closed, found = travel.remove_travel(aligned)
    assert np.abs(found - expected).max() < ROUNDING
    assert np.array_equal(closed.rotations[:, 0], closed.rotations[:, -1])
    assert np.array_equal(closed.root_path[:, 0], closed.root_path[:, -1])
    # Negative control: the clips themselves do not close.
    assert np.abs(aligned.root_path[:, -1] - aligned.root_path[:, 0]).max() > 0.1


def test_put_back_it_gives_the_clips_again(rng):
    aligned, _ = cycles(rng)
    closed, found = travel.remove_travel(aligned)
    share = np.linspace(0.0, 1.0, 20)
    rotations, path = travel.put_back(closed.rotations, closed.root_path, found, share)
    assert np.abs(path - aligned.root_path).max() < ROUNDING
    assert np.abs(np.abs(np.sum(rotations * aligned.rotations, axis=-1)) - 1).max() < ROUNDING
    halfway, _ = travel.put_back(closed.rotations, closed.root_path, 0.5 * found, share)
    assert np.abs(np.abs(np.sum(halfway * aligned.rotations, axis=-1)) - 1).max() > 1e-3


def test_errors_of_the_way_count_a_third_of_their_square():
    assert travel.mean_squared_distance(np.array([[0.3, 0.0, 1.0], [0.0, 0.6, 0.0]])).tolist() == [
        0.03,
        0.12,
    ]
