"""Tests of gaits: the model's range of speed and turning, and control by these."""

from dataclasses import replace

import numpy as np
import pytest

from posefield.common.errors import InvalidField
from posefield.inference import session
from posefield.locomotion import gait, gait_region, stride


@pytest.fixture(scope="module")
def opened(walk_path):
    return session.load(walk_path)


@pytest.fixture(scope="module")
def own(opened):
    return gait.fit_gait(opened)


def test_speeds_and_turning_are_those_of_the_clips(own, strides):
    # The controls say km/h and thousandths of a radian a stride: the model says m/s and rad/s.
    haste, veer = np.array([example.controls for example in strides]).T
    durations = np.array([example.clip.duration for example in strides])
    assert np.abs(own.rates[:, 0] - haste / 3.6).max() < 0.01
    assert np.abs(own.rates[:, 1] - veer / 1000.0 / durations).max() < 0.01


def test_the_model_does_what_was_wanted_whoever_walks(own, opened, rng):
    speeds = rng.uniform(0.8, 1.4, 300)
    turning = rng.uniform(-0.4, 0.4, 300)
    who = rng.integers(-1, 2, 300)
    labels = stride.labels(opened, who)
    done = stride.strides(opened, own.controls(speeds, turning, who), labels)
    assert np.abs(done.speeds - speeds).max() < 2e-3
    assert np.abs(done.turning - turning).max() < 2e-3
    # Negative control: the regression alone is not that near.
    usual = stride.strides(opened, own.mean_controls(speeds, turning, who), labels)
    assert np.abs(usual.turning - turning).max() > 0.01


def test_the_hull_of_a_square_is_the_square(rng):
    corners = np.array([[1.0, -1.0], [2.0, -1.0], [2.0, 1.0], [1.0, 1.0]])
    inner = rng.uniform([1.0, -1.0], [2.0, 1.0], (50, 2))
    found = gait_region.convex_hull(np.vstack([inner, corners]))
    assert len(found.limits) == 4
    assert found.speeds == (1.0, 2.0)
    low, high = found.turning(np.array([1.0, 1.3, 2.0]))
    assert low == pytest.approx(-1.0)
    assert high == pytest.approx(1.0)


def test_a_model_that_is_no_cycle_does_not_walk(model_path):
    with pytest.raises(InvalidField, match="model: reaching is no cycle"):
        gait.fit_gait(session.load(model_path))


def test_a_model_of_one_speed_does_not_walk(opened):
    one = (replace(opened.card.labels[0], clips=(0, 0)),)
    once = replace(opened.card, examples=opened.card.examples[:2], labels=one)
    with pytest.raises(InvalidField, match=r"model: stroll goes 0\.\d+ to 0\.\d+ m/s, expected"):
        gait.fit_gait(replace(opened, card=once))
