"""Tests of projected-process kriging: its theorems, and the clips that it is made with."""

from dataclasses import asdict, replace

import numpy as np
import pytest

from posefield.kriging import kriging_model
from posefield.kriging.kriging_model import Hyper
from posefield_train.graph import trained_card
from posefield_train.kriging import (
    coefficient_models,
    kriging_tuning,
    sample_points,
    universal_kriging,
)
from posefield_train.kriging.sample_points import SamplePoints
from posefield_train.kriging.tuning_loss import PoseLoss, TuningProblem
from posefield_train.kriging.universal_kriging import ProjectedProcess
from posefield_train.source.recipe_sections import Kriging

SAME = 1e-8
NONE = 1e-12
"""Jitter of a system of known condition."""


@pytest.fixture(params=[0, 1], ids=["constant", "linear"])
def hyper(request):
    return Hyper("matern52", (request.param,), np.array([0.5, 0.9, 1.4]), 0.1, 0.7)


@pytest.fixture
def samples(rng):
    return rng.uniform(-1.0, 1.0, size=(60, 3))


@pytest.fixture
def values(rng, samples):
    return np.cos(samples @ rng.normal(size=(3, 4))) + 0.1 * rng.normal(size=(60, 4))


@pytest.fixture
def points(rng):
    return rng.uniform(-1.5, 1.5, size=(20, 3))


def large(samples, inducing):
    """Samples of a family without labels, each a group of its own."""
    return SamplePoints(samples, samples.shape[1], np.arange(len(samples)), inducing=inducing)


def test_with_all_samples_inducing_it_is_universal_kriging(hyper, samples, values):
    dense = universal_kriging.solve(hyper, samples, values)
    own = ProjectedProcess(hyper, samples, samples, NONE)
    assert np.abs(own.dual(values) - dense.dual).max() < SAME
    assert np.abs(own.form - dense.form).max() < SAME
    fewer = ProjectedProcess(hyper, samples, samples[:59], NONE)
    assert np.abs(fewer.dual(values)[:59] - dense.dual[:59]).max() > 1e-3


def test_residuals_of_left_out_groups_are_those_of_a_model_without_them(hyper, samples, values):
    groups, inducing = np.repeat(np.arange(20), 3), samples[:25]
    residuals = ProjectedProcess(hyper, samples, inducing).leave_out(groups) @ values
    for group in range(20):
        own = groups == group
        others = ProjectedProcess(hyper, samples[~own], inducing)
        basis = kriging_model.basis_functions(hyper, samples[own], inducing)
        expected = values[own] - basis @ others.dual(values[~own])
        assert np.abs(residuals[own] - expected).max() < SAME
    uneven = np.minimum(groups, 17)
    process = ProjectedProcess(hyper, samples, inducing)
    expected_rows = process.leave_out(uneven) @ values
    assert np.abs(process.residuals(values, uneven) - expected_rows).max() < SAME
    assert np.abs(process.residuals(values, np.arange(60)) - expected_rows).max() > 1e-3
    whole = ProjectedProcess(hyper, samples, samples, NONE).leave_out(groups)
    assert np.abs(whole - kriging_model.leave_out(hyper, samples, groups)).max() < SAME
    # Negative control: residuals of the fit itself are smaller.
    assert np.abs(residuals[own] - expected).max() < 0.1 * np.abs(residuals[own]).max()


def test_the_drift_is_reproduced_exactly(hyper, samples, points):
    slopes = np.array([[1.0], [-3.0], [0.5]]) if hyper.drifts == (1,) else np.zeros((3, 1))
    field = universal_kriging.solve_samples(
        hyper, large(samples, np.arange(20)), 2.0 + samples @ slopes
    )
    assert np.abs(field.predict(points) - 2.0 - points @ slopes).max() < SAME
    curved = universal_kriging.solve_samples(
        hyper, large(samples, np.arange(20)), np.square(samples)
    )
    assert np.abs(curved.predict(points) - np.square(points)).max() > 1e-3


def test_its_sample_values_give_its_weights(hyper, samples, values, points):
    """A dense model of the inducing clips, which adaptation reads, has equal weights."""
    field = universal_kriging.solve_samples(hyper, large(samples, np.arange(20)), values)
    again = universal_kriging.solve(hyper, field.samples, field.values)
    assert np.abs(again.dual - field.dual).max() < SAME
    weights = field.weights(points)
    assert np.abs(weights.sum(axis=1) - 1.0).max() < SAME
    assert np.abs(weights @ field.values - field.predict(points)).max() < SAME
    assert np.abs(field.values - values[:20]).max() > 1e-2


def test_variance_is_nearer_to_that_of_all_samples_and_grows_away_from_them(hyper, samples, points):
    inducing, nothing = np.arange(30), np.zeros((60, 1))
    own = universal_kriging.solve_samples(hyper, large(samples, inducing), nothing)
    every = universal_kriging.solve(hyper, samples, nothing)
    few = universal_kriging.solve(hyper, samples[inducing], nothing[:30])
    apart, before = (
        np.abs(field.variance(points) - every.variance(points)).mean() for field in (own, few)
    )
    assert apart < 0.8 * before
    away = np.array([[0.0, 0.0, 0.0], [3.0, 3.0, 3.0], [9.0, 9.0, 9.0]])
    grown = own.variance(away)
    assert grown[0] < grown[1] < grown[2]
    assert grown[2] > 1.0 > grown[0]


# --- choice of clips ------------------------------------------------------------------------------


@pytest.fixture
def family(rng):
    """Points of 700 clips: three controls, one of three values, and two performers."""
    controls = np.column_stack([rng.uniform(-1.0, 1.0, (700, 2)), rng.integers(-1, 2, 700)])
    return np.hstack([controls, np.eye(2)[rng.integers(0, 2, 700)]])


def test_ends_values_and_names_are_inducing(family):
    # One performer of the first name alone.
    family[:, 3:] = [0.0, 1.0]
    family[77, 3:] = [1.0, 0.0]
    chosen = sample_points.choose_inducing(family, 3, (2,))
    assert {77, int(np.argmin(family[:, 0])), int(np.argmax(family[:, 0]))} <= {*chosen.tolist()}
    assert set(family[chosen, 2]) == {-1.0, 0.0, 1.0}
    assert (np.diff(chosen) > 0).all()


def test_clips_of_equal_controls_are_inducing_once(family):
    repeated = np.repeat(family[:40], 10, axis=0)
    chosen = sample_points.choose_inducing(repeated, 3, (2,))
    assert sample_points.choose_inducing(family[:299], 3, (2,)) is None, "a small family has none"
    assert len(np.unique(repeated[chosen], axis=0)) == len(chosen)
    assert 38 <= len(chosen) <= 40


def test_inducing_clips_lie_apart(family):
    """The largest distance to the nearest of them is less than that of as many random clips."""
    chosen = sample_points.choose_inducing(family, 3, (2,))

    def gap(own):
        apart = np.linalg.norm(family[:, None] - family[own], axis=-1)
        return apart.min(axis=1).max()

    rng = np.random.Generator(np.random.PCG64(3))
    others = [rng.choice(700, len(chosen), replace=False) for _ in range(9)]
    assert gap(chosen) < min(map(gap, others))


def test_two_draws_for_tuning_share_no_clip(family):
    assert sample_points.choose_tuned(family[:500], 3, (2,), 0).tolist() == list(range(500))
    draws = [sample_points.choose_tuned(family, 3, (2,), draw) for draw in (0, 1)]
    assert not {*draws[0].tolist()} & {*draws[1].tolist()}
    large_family = np.vstack([family, family + 0.01, family - 0.01])
    assert len(sample_points.choose_tuned(large_family, 3, (2,), 0)) == 500
    for points in (family[:500], family[:601], family, large_family):
        count = sample_points.tuned_count(len(points))
        assert len(sample_points.choose_tuned(points, 3, (2,), 0)) == count


def _mean_square(residuals):
    """Mean and standard error of the squared residuals of clips."""
    squares = np.sum(np.square(residuals), axis=1)
    return squares.mean(), squares.std() / np.sqrt(len(squares))


def test_a_large_family_has_the_longest_ranges_within_a_standard_error(rng):
    points = rng.uniform(-1.0, 1.0, (320, 2))
    values = np.sin(3.0 * points @ rng.normal(size=(2, 3))) + 0.1 * rng.normal(size=(320, 3))
    samples = large(points, sample_points.choose_inducing(points, 2, ()))
    settings = Kriging(covariance="matern52")
    tuned = kriging_tuning.tune(TuningProblem(samples, values), "matern52", None)
    chosen = coefficient_models.choose_covariance(settings, samples, values)
    share = chosen.hyper.scales / tuned.hyper.scales
    assert share == pytest.approx(share[0])
    assert 0.5 < share[0] < 1.0
    # Arrays have no single truth value: the other fields are compared as dictionaries.
    same = {"scales": tuple(share)}
    assert asdict(chosen.hyper) | same == asdict(tuned.hyper) | same
    (least, error), (found, _) = _mean_square(tuned.residuals), _mean_square(chosen.residuals)
    assert least < found <= least + error
    # The next longer ranges are beyond it.
    longer = replace(chosen.hyper, scales=chosen.hyper.scales * 0.94)
    beyond, _ = _mean_square(universal_kriging.left_out_residuals(longer, samples, values))
    assert beyond > least + error
    # Negative control: a small family is as tuned.
    few = large(points[:90], None)
    small = coefficient_models.choose_covariance(settings, few, values[:90])
    problem = TuningProblem(few, values[:90])
    alone = kriging_tuning.tune(problem, "matern52", None, loss=PoseLoss)
    assert (small.hyper.scales == alone.hyper.scales).all()


def test_tunings_that_disagree_are_noted(trained):
    def notes(apart):
        pose = replace(trained.pose, disagreement=apart)
        return trained_card.disagreement_notes(replace(trained, pose=pose))

    assert notes(None) == notes(0.02) == []
    (said,) = notes(0.031)
    assert "3.1 % farther away than with the other" in said
