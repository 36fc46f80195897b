"""Tests of durations as powers of controls, alone and in the graph of a bank."""

from dataclasses import replace

import numpy as np
import pytest
from running import bank_values, outputs
from test_graph_labels import HIGH, LOW, asked, labelled_bank, mixed

from posefield.kriging.kriging_model import Hyper
from posefield_train.kriging import kriging_bank
from posefield_train.kriging.kriging_bank import PowerLaw
from posefield_train.kriging.sample_points import SamplePoints

POSE = Hyper("matern52", (0,), np.array([0.5, 0.5, 0.5]), 0.1, 1.0)
LAW = PowerLaw(np.array([0.8, 0.0, -0.6]), np.array([0.75, 1.0, 0.1]))


@pytest.fixture
def controls(rng):
    """Lengths, turns of both signs, and speeds."""
    return rng.uniform([0.8, -60.0, 0.5], [2.0, 60.0, 2.5], (40, 3))


def laid(controls):
    low, high = controls.min(axis=0), controls.max(axis=0)
    points = (2.0 * controls - low - high) / (high - low)
    return SamplePoints(points, 3, np.arange(len(points)) // 2)


def fitted(controls, logs):
    """Fit of logarithms (N, 1), beside residuals of their mean."""
    samples = laid(controls)
    return kriging_bank.fit_power_law(POSE, samples, controls, logs, samples.from_mean(logs))


def test_length_over_speed_comes_back_exactly(controls, rng):
    logs = np.log(1.3 * controls[:, :1] / controls[:, 2:])
    found = fitted(controls, logs)
    assert np.abs(found.law.exponents - [1.0, 0.0, -1.0]).max() < 1e-9
    assert np.abs(found.residuals).max() < 1e-9
    other = rng.uniform([0.8, -60.0, 0.5], [2.0, 60.0, 2.5], (9, 3))
    expected = np.log(other[:, :1] / other[:, 2:])
    assert np.abs(found.law.logarithms(other) - expected).max() < 1e-9
    # Negative control: a sum is no product of powers.
    added = fitted(controls, np.log(1.3 * controls[:, :1] + controls[:, 2:]))
    assert added is None or np.abs(added.residuals).max() > 1e-3


def test_noise_and_what_kriging_predicts_as_well_are_no_powers(controls, rng):
    assert fitted(controls, 0.2 * rng.normal(size=(40, 1))) is None
    samples, logs = laid(controls), np.log(controls[:, :1] / controls[:, 2:])
    noisy = logs + 0.1 * rng.normal(size=(40, 1))
    found = fitted(controls, noisy)
    assert found is not None
    as_good = kriging_bank.fit_power_law(POSE, samples, controls, noisy, 1.2 * found.residuals)
    assert as_good is None


def test_without_a_positive_control_over_a_wide_range_there_is_no_law(controls):
    logs = np.log(controls[:, :1] / controls[:, 2:])
    narrow = 1.0 + 0.01 * controls
    narrow[:, 1] = controls[:, 1]
    assert fitted(narrow, logs) is None
    assert fitted(controls - 10.0, logs) is None


def test_a_law_that_hangs_on_one_take_is_not_fitted(controls):
    lonely = np.repeat(controls[:1], 40, axis=0)
    lonely[0, 2] *= 3.0
    lonely[:, 1] = controls[:, 1]
    samples = SamplePoints(np.zeros((40, 3)), 3, np.arange(40))
    logs = np.log(lonely[:, 2:])
    assert kriging_bank.fit_power_law(POSE, samples, lonely, logs, logs) is None


def test_below_the_floor_controls_count_as_the_floor():
    below = np.array([[0.0, 5.0, -1.0], [0.75, -5.0, 0.1]])
    found = LAW.logarithms(below)
    assert np.isfinite(found).all() and found[0] == found[1]
    assert LAW.logarithms(2.0 * below)[1] != found[1]


RANKS = (6, 4, 3)
COLUMNS = (15, 5)


def levelled(law):
    """A bank of performers and two coarser levels, with a power law for its duration."""
    own = kriging_bank.sort_samples(replace(labelled_bank(drifts=(0,)), power_law=law))
    data = kriging_bank.thinning_data(own)
    pairs = zip(COLUMNS, RANKS[1:], strict=True)
    return replace(own, coarse=tuple(data.weights(n, rank, 0.1) for n, rank in pairs))


@pytest.mark.parametrize("level", [0, 1, 2])
def test_the_graph_multiplies_the_duration_by_the_law_at_every_level(level):
    """Controls of both signs and of performers, inside and outside of the samples."""
    own, controls = levelled(LAW), asked()
    labels = mixed(own.label_count)
    assert LOW[1] < 0.0 < HIGH[1]

    def build(net, controls, *_):
        return bank_values(net, own, controls, list(RANKS))

    found = outputs(build, (2, 2, 2, 1), level=level, controls=controls, labels=labels)
    points = own.points(controls, labels)
    variance, *values = own.numpy(points, level).values()
    for one, other in zip(found, [*values, own.sigma(variance)], strict=True):
        assert np.abs(one - other).max() < 5e-4
    without = replace(own, power_law=None).numpy(points, level)["duration"]
    assert np.abs(found[1] - without - LAW.logarithms(controls)).max() < 5e-4
    assert np.abs(found[1] - without).max() > 0.1
    assert np.abs(own.durations(points) - np.exp(found[1][:, 0])).max() < 1e-3 or level
