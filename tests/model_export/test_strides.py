"""Tests of the detection of strides."""

from dataclasses import replace

import discover_takes
import numpy as np
import pytest

from posefield_train.discover import found_clips
from posefield_train.discover.found_clips import alternating_extrema, find_strides, moving_mean

WALK = {"speed": 1.0, "swing": 0.6, "period": 1.2}
"""Feet 0.6 leg lengths apart; a stride recordings 72 frames and begins at a multiple of 72."""


def cuts(recording):
    return [(one.first, one.last) for one in find_strides(recording) if one.travels]


@pytest.mark.parametrize("heading", [0.0, 3.1])
def test_strides_lie_between_left_feet_most_forward(heading):
    found = cuts(discover_takes.recording("a.bvh", 5.0, heading=heading, **WALK))
    assert found == [(72, 144), (144, 216), (216, 288)]


def test_mirrored_walking_begins_half_a_stride_later():
    """Negative control: the cuts follow the left foot, not any foot."""
    recording = discover_takes.recording("a.bvh", 5.0, **(WALK | {"swing": -0.6}))
    assert cuts(recording) == [(36, 108), (108, 180), (180, 252)]


def test_a_rate_changes_frames_and_not_times():
    slow = discover_takes.recording("a.bvh", 5.0, **WALK)
    places = {role: own[::2] for role, own in slow.places.items()}
    half = replace(slow, rate=30.0, places=places)
    assert cuts(half) == [(first // 2, last // 2) for first, last in cuts(slow)]


def test_swings_in_place_are_found_and_do_not_travel():
    recording = discover_takes.recording("a.bvh", 5.0, **(WALK | {"speed": 0.0}))
    found = find_strides(recording)
    assert len(found) == 3 and not any(one.travels for one in found)
    assert max(one.travel for one in found) < 0.01


@pytest.mark.parametrize("change", [{"swing": 0.1}, {"period": 0.4}, {"period": 3.0}])
def test_small_fast_and_slow_swings_are_no_strides(change):
    assert find_strides(discover_takes.recording("a.bvh", 12.0, **(WALK | change))) == []


def test_extrema_alternate_and_small_swings_do_not_count():
    rng = np.random.default_rng(1)
    for _ in range(50):
        values = np.cumsum(rng.normal(0.0, 0.1, 300))
        found = alternating_extrema(values)
        signs = [sign for _, sign in found]
        assert signs == [signs[0] * (-1) ** at for at in range(len(signs))] if signs else True
        steps = np.abs(np.diff([values[at] for at, _ in found]))
        assert np.all(steps >= found_clips.HYSTERESIS)
        assert [at for at, _ in found] == sorted(at for at, _ in found)


def test_the_moving_mean_is_that_of_the_window():
    values = np.random.default_rng(2).normal(size=40)
    padded = np.pad(values, 3, mode="edge")
    expected = [padded[at : at + 7].mean() for at in range(40)]
    np.testing.assert_allclose(moving_mean(values, 7), expected, atol=1e-12)
    np.testing.assert_allclose(moving_mean(values, 6), expected, atol=1e-12)
