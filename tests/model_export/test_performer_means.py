"""Tests of the shrinkage of poses toward the mean motions of performers."""

from dataclasses import replace

import numpy as np
import pytest
from label_kernels import performers

from posefield.kriging.kriging_model import Hyper
from posefield_train.kriging import kriging_tuning, performer_means, universal_kriging
from posefield_train.kriging.sample_points import SamplePoints

COUNT, TAKES, PEOPLE = 36, 12, 3
HYPER = Hyper("matern52", (0,), np.array([0.6, 0.4]), 0.2, 0.5, performers(PEOPLE, 0.7, 0.6))


@pytest.fixture
def samples(rng):
    """Clips in takes of three performers, the last of whom has one take only."""
    recordings = np.sort(np.arange(COUNT) % TAKES)
    names = np.where(recordings == TAKES - 1, 2, recordings % 2)
    points = np.hstack([rng.uniform(-1.0, 1.0, (COUNT, 2)), np.eye(PEOPLE)[names]])
    return SamplePoints(points, 2, recordings, (PEOPLE,))


def names_of(samples):
    return np.argmax(samples.points[:, 2:], axis=1)


def test_left_out_residuals_are_those_of_models_without_the_take(samples, rng):
    values, share = rng.normal(size=(COUNT, 4)), 0.3
    tuned = replace(kriging_tuning.evaluate_fixed(HYPER, samples, values), share=share)
    found, names = performer_means.leave_out(tuned, samples) @ values, names_of(samples)
    for take in range(TAKES):
        own = samples.groups == take
        known, moved = values[~own], values[~own].copy()
        for name in np.unique(names[~own]):
            same = names[~own] == name
            moved[same] += share * (known[same].mean(axis=0) - known[same])
        field = universal_kriging.solve(HYPER, samples.points[~own], moved)
        expected = values[own] - field.predict(samples.points[own])
        assert found[own] == pytest.approx(expected, abs=1e-9)
    # Negative control: without the share.
    plain = performer_means.leave_out(replace(tuned, share=0.0), samples) @ values
    assert np.abs(plain - found).max() > 0.05


def test_the_share_is_the_best_one_and_moves_the_samples_toward_their_performers(samples, rng):
    """Performers differ, controls say little."""
    values = 3.0 * rng.normal(size=(PEOPLE, 4))[names_of(samples)] + rng.normal(size=(COUNT, 4))
    tuned = kriging_tuning.evaluate_fixed(HYPER, samples, values)
    shrunk = performer_means.shrink(tuned, samples, values, None)
    assert shrunk.share > performer_means.NEGLIGIBLE
    assert shrunk.residuals == pytest.approx(performer_means.leave_out(shrunk, samples) @ values)
    least = np.sum(np.square(shrunk.residuals))
    for other in (shrunk.share - 0.1, shrunk.share + 0.1):
        left = performer_means.leave_out(replace(tuned, share=other), samples) @ values
        assert np.sum(np.square(left)) > least
    assert shrunk.unexplained / tuned.unexplained == pytest.approx(
        least / np.sum(np.square(tuned.residuals))
    )
    moved, means = performer_means.move(samples, shrunk.share, values), names_of(samples)
    for name in range(PEOPLE):
        same = means == name
        centre = values[same].mean(axis=0)
        assert moved[same] - centre == pytest.approx((1.0 - shrunk.share) * (values[same] - centre))


def test_samples_stay_where_controls_explain_them_where_the_event_needs_them_and_without_names(
    samples, rng
):
    def share(laid, values, effector=None):
        tuned = kriging_tuning.evaluate_fixed(HYPER, laid, values)
        return performer_means.shrink(tuned, laid, values, effector).share

    explained = np.hstack([np.sin(2.0 * samples.half_ranges), samples.half_ranges])
    assert share(samples, explained) == 0.0
    noise = rng.normal(size=(COUNT, 4))
    assert share(samples, noise) > 0.1
    # An event that follows the controls counts, however much of the pose is noise.
    both = np.hstack([0.2 * explained, noise])
    effector = np.tile(10.0 * np.eye(3, 4), (COUNT, 1, 1))
    assert share(samples, both, effector) < 0.5 * share(samples, both)
    alone = SamplePoints(samples.half_ranges, 2, samples.groups)
    unnamed = kriging_tuning.evaluate_fixed(replace(HYPER, labels=()), alone, noise)
    assert performer_means.shrink(unnamed, alone, noise, None) is unnamed
