"""Tests of the tuning of scales and nugget by leave-one-out."""

import numpy as np
import pytest

from posefield_train.kriging import kriging_tuning, universal_kriging, variogram
from posefield_train.kriging.kriging_tuning import LABEL_BOUNDS, NUGGET_BOUNDS, SCALE_BOUNDS
from posefield_train.kriging.sample_points import SamplePoints
from posefield_train.kriging.universal_kriging import Hyper


@pytest.fixture
def samples(rng):
    return rng.uniform(-1.0, 1.0, size=(50, 2))


def wave(samples):
    """Fast in the first control, slow in the second."""
    x, y = samples.T
    return np.stack([np.sin(4.0 * x) + 0.3 * y**2, np.cos(3.0 * x)], axis=1)


def guess(samples, values, covariance="matern52"):
    experimental = variogram.residual_variogram(samples, values, 1)
    return kriging_tuning.initial_guess(experimental, samples.shape[1], covariance, (1,))


def alone(samples):
    """Return samples, each its own group, without performer labels."""
    return SamplePoints(samples, samples.shape[1], np.arange(len(samples)))


def tuned_at(samples, values, nugget=None):
    return kriging_tuning.tune(guess(samples, values), alone(samples), values, nugget)


def left_out(hyper, samples, values):
    """Squared residuals of predicting each sample from all the others, one by one."""
    total = 0.0
    for i in range(len(samples)):
        kept = np.arange(len(samples)) != i
        field = universal_kriging.solve(hyper, samples[kept], values[kept])
        total += np.sum((values[i] - field.predict(samples[i : i + 1])[0]) ** 2)
    return total


def test_first_guess_keeps_within_the_bounds(samples, rng):
    for values in (wave(samples), samples.copy(), rng.normal(size=(50, 3)), np.zeros((50, 2))):
        hyper = guess(samples, values)
        assert np.all((hyper.scales >= SCALE_BOUNDS[0]) & (hyper.scales <= SCALE_BOUNDS[1]))
        assert NUGGET_BOUNDS[0] <= hyper.nugget <= NUGGET_BOUNDS[1]


def test_residuals_and_their_share_are_those_of_leaving_out(samples, rng):
    values = wave(samples) + 0.2 * rng.normal(size=(50, 2))
    hyper = Hyper("matern52", (1,), np.array([1.0, 0.5]), 0.1, 0.0)
    found = kriging_tuning.evaluate_fixed(hyper, alone(samples), values)
    mean_of_others = (values.sum(axis=0) - values) / 49
    share = left_out(hyper, samples, values) / np.sum((values - mean_of_others) ** 2)
    assert abs(found.unexplained - share) < 1e-9
    around_own_mean = left_out(hyper, samples, values) / np.sum((values - values.mean(axis=0)) ** 2)
    assert abs(found.unexplained - around_own_mean) > 1e-4
    assert abs(np.sum(np.square(found.residuals)) - left_out(hyper, samples, values)) < 1e-9


def test_sill_makes_the_residuals_as_large_as_their_variances_say(rng):
    samples = rng.uniform(-1.0, 1.0, size=(400, 2))
    hyper = Hyper("matern52", (0,), np.array([1.0, 1.0]), 0.1, 0.0)
    root = np.linalg.cholesky(
        universal_kriging.covariances(hyper, samples, samples) + 0.1 * np.eye(400)
    )
    values = np.sqrt(2.5) * root @ rng.normal(size=(400, 6))
    found = kriging_tuning.evaluate_fixed(hyper, alone(samples), values)
    # Summed over six values; 2400 squares scatter by three per cent.
    assert abs(found.sill / (6 * 2.5) - 1.0) < 0.1
    unscaled = np.mean(np.sum(np.square(found.residuals), axis=1))
    assert abs(unscaled / (6 * 2.5) - 1.0) > 0.1


def test_tuning_leaves_less_than_any_start(samples, rng):
    values = wave(samples) + 0.05 * rng.normal(size=(50, 2))
    own = guess(samples, values)
    tuned = tuned_at(samples, values)
    best = np.sum(np.square(tuned.residuals))
    for scale in (0.2, 0.5, 1.2):
        for nugget in (0.02, 0.3, 2.0):
            start = Hyper("matern52", (1,), np.full(2, scale), nugget, 0.0)
            assert best <= np.sum(
                np.square(kriging_tuning.evaluate_fixed(start, alone(samples), values).residuals)
            )
    assert best <= np.sum(
        np.square(kriging_tuning.evaluate_fixed(own, alone(samples), values).residuals)
    )


def test_tuned_parameters_keep_within_the_bounds(samples, rng):
    for values in (wave(samples), samples @ np.ones((2, 1)), rng.normal(size=(50, 2))):
        hyper = tuned_at(samples, values).hyper
        assert np.all(
            (hyper.scales >= SCALE_BOUNDS[0] - 1e-12) & (hyper.scales <= SCALE_BOUNDS[1] + 1e-12)
        )
        assert NUGGET_BOUNDS[0] * (1 - 1e-9) <= hyper.nugget <= NUGGET_BOUNDS[1] * (1 + 1e-9)


def test_control_that_matters_more_gets_the_larger_scale(samples):
    values = wave(samples)
    x, y = tuned_at(samples, values).hyper.scales
    assert x > 2.0 * y
    swapped = samples[:, ::-1]
    x, y = tuned_at(swapped, values).hyper.scales
    assert y > 2.0 * x


def test_nugget_is_worth_the_variance_of_the_noise(samples, rng):
    smooth = tuned_at(samples, wave(samples))
    noisy = wave(samples) + 0.5 * rng.normal(size=(50, 2))
    rough = tuned_at(samples, noisy)
    expected = 2 * 0.5**2
    assert 0.5 * expected < rough.hyper.nugget * rough.sill < 2.0 * expected
    assert smooth.hyper.nugget * smooth.sill < 0.1 * expected


def test_given_nugget_is_kept(samples):
    values = wave(samples)
    tuned = tuned_at(samples, values, 0.037)
    assert tuned.hyper.nugget == 0.037
    free = tuned_at(samples, values)
    assert free.hyper.nugget != 0.037
    assert free.unexplained <= tuned.unexplained


def test_controls_explain_a_smooth_field_and_no_noise(samples, rng):
    noise = rng.normal(size=(50, 4))
    assert tuned_at(samples, wave(samples)).unexplained < 0.05
    assert tuned_at(samples, noise).unexplained > 0.9


def test_values_that_never_change_count_as_unexplained(samples):
    hyper = Hyper("matern52", (1,), np.ones(2), 0.1, 0.0)
    assert (
        kriging_tuning.evaluate_fixed(hyper, alone(samples), np.zeros((50, 2))).unexplained == 1.0
    )


PEOPLE, TAKES = 4, 20


@pytest.fixture
def people():
    """Return the performer and take of each of fifty samples: a take has one performer."""
    take = np.arange(50) % TAKES
    return take % PEOPLE, take


def labelled(samples, people):
    who, takes = people
    return SamplePoints(np.hstack([samples, np.eye(PEOPLE)[who]]), 2, takes)


def own_ways(samples, people, rng, apart):
    """Everybody's own wave on top of the common one."""
    offsets = apart * rng.normal(size=(PEOPLE, 2))
    return wave(samples) + offsets[people[0]] + 0.05 * rng.normal(size=(50, 2))


def tuned_for(samples, people, values, nugget=None):
    return kriging_tuning.tune(guess(samples, values), labelled(samples, people), values, nugget)


def test_groups_are_left_out_together(samples, people, rng):
    values = own_ways(samples, people, rng, 1.0)
    hyper = Hyper("matern52", (0, 1), np.array([1.0, 0.5]), 0.1, 0.8)
    laid = labelled(samples, people)
    found = kriging_tuning.evaluate_fixed(hyper, laid, values)
    residuals, from_mean, variances = np.empty((50, 2)), np.empty((50, 2)), np.empty(50)
    for take in range(TAKES):
        own = people[1] == take
        field = universal_kriging.solve(hyper, laid.points[~own], values[~own])
        residuals[own] = values[own] - field.predict(laid.points[own])
        variances[own] = field.variance(laid.points[own]) + 0.1
        from_mean[own] = values[own] - values[~own].mean(axis=0)
    assert np.max(np.abs(found.residuals - residuals)) < 1e-9
    assert np.max(np.abs(found.variances - variances)) < 1e-9
    assert abs(found.unexplained - np.sum(residuals**2) / np.sum(from_mean**2)) < 1e-9
    single = kriging_tuning.evaluate_fixed(
        hyper, SamplePoints(laid.points, 2, np.arange(50)), values
    )
    assert np.max(np.abs(single.residuals - residuals)) > 1e-2
    assert abs(single.unexplained - found.unexplained) > 1e-3


def test_performers_who_move_differently_are_told_apart(samples, people, rng):
    values = own_ways(samples, people, rng, 1.0)
    apart = tuned_for(samples, people, values)
    # What counts is the label beside the nugget: this one is far above what alike ones get.
    assert apart.hyper.label > 4.0 * LABEL_BOUNDS[0]
    blind = kriging_tuning.tune(
        guess(samples, values), SamplePoints(samples, 2, people[1]), values, None
    )
    assert apart.unexplained < 0.5 * blind.unexplained


def test_performers_who_move_alike_are_not_told_apart(samples, people, rng):
    alike = tuned_for(samples, people, own_ways(samples, people, rng, 0.0))
    # At the bound, to which the simplex is clipped.
    assert alike.hyper.label < 1.2 * LABEL_BOUNDS[0]


def test_label_keeps_within_its_bounds(samples, people, rng):
    for apart in (0.0, 0.3, 100.0):
        label = tuned_for(samples, people, own_ways(samples, people, rng, apart)).hyper.label
        assert LABEL_BOUNDS[0] * (1 - 1e-9) <= label <= LABEL_BOUNDS[1] * (1 + 1e-9)
    assert tuned_at(samples, wave(samples)).hyper.label == 0.0


def test_tuning_with_labels_leaves_less_than_any_start(samples, people, rng):
    values = own_ways(samples, people, rng, 0.5)
    best = np.sum(np.square(tuned_for(samples, people, values).residuals))
    for scale in (0.2, 1.2):
        for label in (0.5, 2.0):
            start = Hyper("matern52", (1,), np.full(2, scale), 0.02, label)
            found = kriging_tuning.evaluate_fixed(
                start, labelled(samples, people), values
            ).residuals
            assert best <= np.sum(np.square(found))


def test_tuning_twice_gives_the_same_bits(samples, people, rng):
    values = own_ways(samples, people, rng, 0.5)
    a, b = (tuned_for(samples, people, values) for _ in range(2))
    assert np.array_equal(a.residuals, b.residuals)
    assert (a.hyper.label, a.hyper.nugget) == (b.hyper.label, b.hyper.nugget)


def alike(a, b):
    """Compare two fields: the simplex stops when its corners lie within a per cent."""
    near = np.max(np.abs(np.log(a.hyper.scales / b.hyper.scales))) < 0.05
    return near and abs(a.unexplained - b.unexplained) < 1e-4


def test_order_of_samples_does_not_matter(samples, rng):
    values = wave(samples) + 0.1 * rng.normal(size=(50, 2))
    order = rng.permutation(50)
    first = tuned_at(samples, values)
    assert alike(first, tuned_at(samples[order], values[order]))
    assert not alike(first, tuned_at(samples[order], values))


def test_order_of_labelled_and_grouped_samples_does_not_matter(samples, people, rng):
    values = own_ways(samples, people, rng, 0.5)
    order = rng.permutation(50)
    who, takes = people
    first = tuned_for(samples, people, values)
    second = tuned_for(samples[order], (who[order], takes[order]), values[order])
    assert alike(first, second)
    assert abs(np.log(first.hyper.label / second.hyper.label)) < 0.05
    # Who is called first, and which take, is nothing either.
    renamed = (who + 1) % PEOPLE, (7 * takes) % TAKES
    third = tuned_for(samples, renamed, values)
    assert alike(first, third)
    assert not alike(first, tuned_for(samples, (who[order], takes[order]), values))
