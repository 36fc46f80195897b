"""Tests of accelerations relative to the root: theorems for waves and for rigid motions."""

import numpy as np
import pytest

from posefield.model_file.captured_acceleration import mean_accelerations

SIZE, FREQUENCY = 0.2, 2.0 * np.pi * 1.5
"""Amplitude, m, and angular frequency, rad/s, of the wave of a joint."""
PRECISION = 3e-3
"""The second difference of a wave is smaller than its acceleration by (frequency / rate)² / 12."""


def waving(rate, seconds=2.0):
    """Return positions (F, 2, 3) of a root that travels with a joint that waves sideways."""
    times = np.arange(round(seconds * rate) + 1) / rate
    root = np.stack([0.3 * np.sin(5 * times), 1.0 + 0.1 * np.cos(9 * times), 1.2 * times], axis=1)
    joint = root + SIZE * np.sin(FREQUENCY * times)[:, None] * [1.0, 0.0, 0.0]
    expected = SIZE * FREQUENCY**2 * np.abs(np.sin(FREQUENCY * times[1:-1]))
    return np.stack([root, joint], axis=1), expected


@pytest.mark.parametrize("rate", [60.0, 120.0])
def test_a_wave_accelerates_by_its_size_times_its_frequency_squared(rate):
    places, expected = waving(rate)
    # The mean over the joints counts the root, which is still relative to itself.
    found = 2.0 * mean_accelerations(places, rate)
    assert len(found) == len(places) - 2
    assert np.abs(found - expected).max() < PRECISION * expected.max()
    # Negative control: at another rate it is another acceleration.
    other = 2.0 * mean_accelerations(places, 1.1 * rate)
    assert np.abs(other - expected).max() > 10.0 * PRECISION * expected.max()


def test_the_motion_of_the_root_does_not_count():
    places, _ = waving(60.0)
    jolted = places + np.random.default_rng(1).normal(size=(len(places), 1, 3))
    still, moved = (mean_accelerations(own, 60.0) for own in (places, jolted))
    assert np.abs(moved - still).max() < 1e-9
    # Negative control: a motion of the joint alone does.
    jolted[:, 0] = places[:, 0]
    assert np.abs(mean_accelerations(jolted, 60.0) - still).max() > 1.0
