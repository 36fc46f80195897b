"""Scales and nugget by leave-one-out."""

import numpy as np
import pytest

from model_export import kriging, tune
from model_export.kriging import Hyper
from model_export.tune import NUGGETS, SCALES


@pytest.fixture
def samples(rng):
    return rng.uniform(-1.0, 1.0, size=(50, 2))


def wave(samples):
    """Fast in the first control, slow in the second."""
    x, y = samples.T
    return np.stack([np.sin(4.0 * x) + 0.3 * y**2, np.cos(3.0 * x)], axis=1)


def guess(samples, values, covariance="matern52"):
    return tune.first_guess(samples, values, covariance, 1)


def left_out(hyper, samples, values):
    """Squared residuals of predicting each sample from all the others, one by one."""
    total = 0.0
    for i in range(len(samples)):
        kept = np.arange(len(samples)) != i
        field = kriging.solve(hyper, samples[kept], values[kept])
        total += np.sum((values[i] - field.predict(samples[i : i + 1])[0]) ** 2)
    return total


def test_first_guess_keeps_within_the_bounds(samples, rng):
    for values in (wave(samples), samples.copy(), rng.normal(size=(50, 3)), np.zeros((50, 2))):
        hyper = guess(samples, values)
        assert np.all((hyper.scales >= SCALES[0]) & (hyper.scales <= SCALES[1]))
        assert NUGGETS[0] <= hyper.nugget <= NUGGETS[1]


def test_residuals_and_their_share_are_those_of_leaving_out(samples, rng):
    values = wave(samples) + 0.2 * rng.normal(size=(50, 2))
    hyper = Hyper("matern52", 1, np.array([1.0, 0.5]), 0.1)
    found = tune.fixed(hyper, samples, values)
    mean_of_others = (values.sum(axis=0) - values) / 49
    share = left_out(hyper, samples, values) / np.sum((values - mean_of_others) ** 2)
    assert abs(found.unexplained - share) < 1e-9
    around_own_mean = left_out(hyper, samples, values) / np.sum((values - values.mean(axis=0)) ** 2)
    assert abs(found.unexplained - around_own_mean) > 1e-4
    assert abs(np.sum(np.square(found.residuals)) - left_out(hyper, samples, values)) < 1e-9


def test_sill_makes_the_residuals_as_large_as_their_variances_say(rng):
    samples = rng.uniform(-1.0, 1.0, size=(400, 2))
    hyper = Hyper("matern52", 0, np.array([1.0, 1.0]), 0.1)
    root = np.linalg.cholesky(kriging.covariances(hyper, samples, samples) + 0.1 * np.eye(400))
    values = np.sqrt(2.5) * root @ rng.normal(size=(400, 6))
    found = tune.fixed(hyper, samples, values)
    # Summed over six values; 2400 squares scatter by three per cent.
    assert abs(found.sill / (6 * 2.5) - 1.0) < 0.1
    unscaled = np.mean(np.sum(np.square(found.residuals), axis=1))
    assert abs(unscaled / (6 * 2.5) - 1.0) > 0.1


def test_tuning_leaves_less_than_any_start(samples, rng):
    values = wave(samples) + 0.05 * rng.normal(size=(50, 2))
    own = guess(samples, values)
    tuned = tune.tune(own, samples, values, None)
    best = np.sum(np.square(tuned.residuals))
    for scale in (0.2, 0.5, 1.2):
        for nugget in (0.02, 0.3, 2.0):
            start = Hyper("matern52", 1, np.full(2, scale), nugget)
            assert best <= np.sum(np.square(tune.fixed(start, samples, values).residuals))
    assert best <= np.sum(np.square(tune.fixed(own, samples, values).residuals))


def test_tuned_parameters_keep_within_the_bounds(samples, rng):
    for values in (wave(samples), samples @ np.ones((2, 1)), rng.normal(size=(50, 2))):
        hyper = tune.tune(guess(samples, values), samples, values, None).hyper
        assert np.all((hyper.scales >= SCALES[0] - 1e-12) & (hyper.scales <= SCALES[1] + 1e-12))
        assert NUGGETS[0] * (1 - 1e-9) <= hyper.nugget <= NUGGETS[1] * (1 + 1e-9)


def test_control_that_matters_more_gets_the_larger_scale(samples):
    values = wave(samples)
    x, y = tune.tune(guess(samples, values), samples, values, None).hyper.scales
    assert x > 2.0 * y
    swapped = samples[:, ::-1]
    x, y = tune.tune(guess(swapped, values), swapped, values, None).hyper.scales
    assert y > 2.0 * x


def test_nugget_is_worth_the_variance_of_the_noise(samples, rng):
    smooth = tune.tune(guess(samples, wave(samples)), samples, wave(samples), None)
    noisy = wave(samples) + 0.5 * rng.normal(size=(50, 2))
    rough = tune.tune(guess(samples, noisy), samples, noisy, None)
    expected = 2 * 0.5**2
    assert 0.5 * expected < rough.hyper.nugget * rough.sill < 2.0 * expected
    assert smooth.hyper.nugget * smooth.sill < 0.1 * expected


def test_given_nugget_is_kept(samples):
    values = wave(samples)
    tuned = tune.tune(guess(samples, values), samples, values, 0.037)
    assert tuned.hyper.nugget == 0.037
    free = tune.tune(guess(samples, values), samples, values, None)
    assert free.hyper.nugget != 0.037
    assert free.unexplained <= tuned.unexplained


def test_controls_explain_a_smooth_field_and_no_noise(samples, rng):
    noise = rng.normal(size=(50, 4))
    assert tune.tune(guess(samples, wave(samples)), samples, wave(samples), None).unexplained < 0.05
    assert tune.tune(guess(samples, noise), samples, noise, None).unexplained > 0.9


def test_values_that_never_change_count_as_unexplained(samples):
    assert (
        tune.fixed(Hyper("matern52", 1, np.ones(2), 0.1), samples, np.zeros((50, 2))).unexplained
        == 1.0
    )


def test_tuned_field_carries_the_inverse_of_its_own_system(samples):
    tuned = tune.tune(guess(samples, wave(samples)), samples, wave(samples), None)
    assert np.array_equal(tuned.inverse, kriging.invert(tuned.hyper, samples))


def test_order_of_samples_does_not_matter(samples, rng):
    values = wave(samples) + 0.1 * rng.normal(size=(50, 2))
    order = rng.permutation(50)
    a = tune.tune(guess(samples, values), samples, values, None)
    b = tune.tune(guess(samples[order], values[order]), samples[order], values[order], None)
    # The simplex stops when its corners lie within a per cent of one another.
    assert np.max(np.abs(np.log(a.hyper.scales / b.hyper.scales))) < 0.05
    assert abs(a.unexplained - b.unexplained) < 1e-4
