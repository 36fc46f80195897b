"""Tests of the measures of feet on motions whose measures are known."""

import numpy as np
import pytest
from evaluation import foot_quality

from posefield.motion.clip import Clip
from posefield.motion.skeleton import Skeleton

RATE, FRAMES = 60.0, 61
FOOT, KNEE = 2, 1


@pytest.fixture
def leg():
    return Skeleton(("Hip", "Knee", "Foot"), (-1, 0, 1), np.zeros((3, 3)), (2,), np.zeros((1, 3)))


def moving(leg, path, knee=None):
    """A clip whose foot goes along a path (F, 3), and whose root rests at the origin."""
    translations = np.zeros((len(path), 3, 3))
    translations[:, KNEE] = 0.0 if knee is None else knee
    translations[:, FOOT] = path - translations[:, KNEE]
    rotations = np.tile([1.0, 0.0, 0.0, 0.0], (len(path), 3, 1))
    return Clip(leg, rotations, translations, RATE)


def measured(clip):
    return foot_quality.measure(clip, RATE, (FOOT,), (KNEE,))


def along(speed, height=0.0):
    seconds = np.arange(FRAMES) / RATE
    return np.stack([speed * seconds, np.full(FRAMES, height), np.zeros(FRAMES)], axis=1)


def test_a_foot_that_slides_on_the_ground_skates_at_its_speed(leg):
    found = measured(moving(leg, along(0.3)))
    assert found.skate == pytest.approx(0.3)
    assert found.weighted_skate == pytest.approx(0.3)
    assert found.acceleration == pytest.approx(0.0, abs=1e-9)


def test_a_single_low_frame_does_not_hide_a_slide_from_the_weighted_measure(leg):
    path = along(0.3, 0.01)
    path[30, 1] = -0.05
    found = measured(moving(leg, path))
    assert found.skate == 0.0, "only one frame is within 2 cm of the lowest"
    assert found.weighted_skate > 0.25


@pytest.mark.parametrize(("height", "weight"), [(0.0, 1.0), (0.0125, 2.0 - 2.0**0.5), (0.03, 0.0)])
def test_a_speed_counts_less_the_higher_the_foot_is(leg, height, weight):
    path = along(0.3)
    path[::4, 0], path[::4, 1] = path[::4, 0], 0.0
    path[:, 1] = height
    path[-3:, 1] = 0.0
    path[-3:, 0] = path[-4, 0]
    found = foot_quality.weighted_skate_speed(path[:, None], RATE)
    low = FRAMES - 1 if height < foot_quality.SLIDING_HEIGHT else 3
    sliding = FRAMES - 4 if height < foot_quality.SLIDING_HEIGHT else 0
    assert found == pytest.approx(0.3 * weight * sliding / low, abs=1e-3)


def test_the_knees_acceleration_is_that_of_their_path(leg):
    seconds = np.arange(FRAMES) / RATE
    knee = np.stack([2.0 * seconds**2, 0.0 * seconds, 0.0 * seconds], axis=1)
    found = measured(moving(leg, along(0.0), knee))
    assert found.knee_mean == pytest.approx(4.0)
    assert found.knee_peak == pytest.approx(4.0)
    # Mean over both joints but the root, of which the foot rests.
    assert found.acceleration == pytest.approx(2.0)
