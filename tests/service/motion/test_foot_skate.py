"""Tests of foot skate: speeds of feet on the ground, and none in the air."""

import numpy as np
import pytest

from posefield.motion import foot_skate

RATE = 30.0
SECONDS = np.arange(31) / RATE


def foot(height, along):
    """One foot's places (F, 1, 3) of heights and ways forward, m."""
    return np.stack([np.zeros(31), height + 0.0 * SECONDS, along], axis=-1)[:, None]


def test_a_foot_that_slides_does_so_at_its_speed():
    assert foot_skate.mean_skate_speed(foot(0.1, 0.4 * SECONDS), RATE) == pytest.approx(0.4)
    assert foot_skate.mean_skate_speed(foot(0.1, 0.4 * SECONDS), 2 * RATE) == pytest.approx(0.8)


def test_only_the_ground_counts():
    lifted = np.where(SECONDS > 0.5, 0.3, 0.0)
    assert foot_skate.mean_skate_speed(foot(lifted, np.where(SECONDS > 0.5, 9.0, 0.0)), RATE) == 0.0
    # Negative control: the same leap on the ground is seen.
    assert foot_skate.mean_skate_speed(foot(0.0, np.where(SECONDS > 0.5, 9.0, 0.0)), RATE) > 5.0


def test_every_motion_of_a_crowd_has_its_own_floor():
    low, high = foot(0.0, 0.1 * SECONDS), foot(7.0, 0.2 * SECONDS)
    assert foot_skate.mean_skate_speed(np.stack([low, high]), RATE) == pytest.approx([0.1, 0.2])


def test_without_feet_nothing_slides():
    assert foot_skate.mean_skate_speed(np.zeros((2, 31, 0, 3)), RATE).tolist() == [0.0, 0.0]
