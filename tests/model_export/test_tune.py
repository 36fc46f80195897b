"""Tests of the tuning of kriging parameters by leave-one-out with a prior."""

from dataclasses import replace

import numpy as np
import pytest
from label_kernels import performers, vary

from posefield.kriging import kriging_model
from posefield.kriging.kriging_model import Hyper
from posefield_train.kriging import kriging_tuning, universal_kriging
from posefield_train.kriging.kriging_graph import COVARIANCES
from posefield_train.kriging.sample_points import SamplePoints
from posefield_train.kriging.tuning_loss import PRIORS, SCALE_PRIOR, LeaveOneOutLoss, TuningProblem


@pytest.fixture
def samples(rng):
    return rng.uniform(-1.0, 1.0, size=(50, 2))


def wave(samples):
    """Fast in the first control, slow in the second."""
    x, y = samples.T
    return np.stack([np.sin(4.0 * x) + 0.3 * y**2, np.cos(3.0 * x)], axis=1)


def alone(samples):
    """Return samples, each its own group, without performer labels."""
    return SamplePoints(samples, samples.shape[1], np.arange(len(samples)))


def tuned_at(samples, values, nugget=None, degree=None):
    return kriging_tuning.tune(TuningProblem(alone(samples), values, nugget), "matern52", degree)


def test_sill_makes_the_residuals_as_large_as_their_variances_say(rng):
    samples = rng.uniform(-1.0, 1.0, size=(400, 2))
    hyper = Hyper("matern52", (0,), np.array([1.0, 1.0]), 0.1, 0.0)
    root = np.linalg.cholesky(
        kriging_model.covariances(hyper, samples, samples) + 0.1 * np.eye(400)
    )
    values = np.sqrt(2.5) * root @ rng.normal(size=(400, 6))
    found = kriging_tuning.evaluate_fixed(hyper, alone(samples), values)
    # Summed over six values; 2400 squares scatter by three per cent.
    assert abs(found.sill / (6 * 2.5) - 1.0) < 0.1
    unscaled = np.mean(np.sum(np.square(found.residuals), axis=1))
    assert abs(unscaled / (6 * 2.5) - 1.0) > 0.1


PEOPLE, TAKES = 4, 20


@pytest.fixture
def people():
    """Return the performer and recording of each of fifty samples, one each."""
    recording = np.arange(50) % TAKES
    return recording % PEOPLE, recording


def labelled(samples, people):
    who, recordings = people
    return SamplePoints(np.hstack([samples, np.eye(PEOPLE)[who]]), 2, recordings, (PEOPLE,))


def own_ways(samples, people, rng, apart):
    """Everybody's own offset on top of the common wave."""
    offsets = apart * rng.normal(size=(PEOPLE, 2))
    return wave(samples) + offsets[people[0]] + 0.05 * rng.normal(size=(50, 2))


def tuned_for(samples, people, values):
    problem = TuningProblem(labelled(samples, people), values)
    return kriging_tuning.tune(problem, "matern52", None)


LABELLED = Hyper("matern52", (0,), np.array([1.0, 0.5]), 0.1, 2.0, performers(PEOPLE, 0.7, 0.6))
ALL = tuple((name, 0) for name in PRIORS)
NO_LABELS = (("nugget", 0), ("trend", 0))
BESIDE = tuple(name for name in ALL if name[0] != "correlation")


def value_of(hyper, name):
    """Return the value of a parameter, which is a name and the index of a label set."""
    kernel = name[0] in ("correlation", "offset")
    return getattr(hyper.labels[name[1]] if kernel else hyper, name[0])


def in_search_units(hyper, names=ALL):
    """Return the point of the search at parameters: scales, then those named."""
    values = [(name, value_of(hyper, name)) for name in names]
    own = [
        np.log(value / (1.0 - value)) if name[0] == "correlation" else np.log(value)
        for name, value in values
    ]
    return np.array([*np.log(hyper.scales), *own])


def loss_of(problem, hyper, names=ALL, own_scales=True):
    return LeaveOneOutLoss(problem, hyper, names, own_scales)


@pytest.mark.parametrize("effector", [False, True])
def test_loss_is_that_of_leaving_takes_out_one_by_one(samples, people, rng, effector):
    values, laid = rng.normal(size=(50, 4)), labelled(samples, people)
    maps = 0.5 * rng.normal(size=(50, 3, 2)) if effector else None
    problem = TuningProblem(laid, values, effector=maps)
    squares = 0.0
    for recording in range(TAKES):
        own = people[1] == recording
        field = universal_kriging.solve(LABELLED, laid.points[~own], values[~own])
        missed = values[own] - field.predict(laid.points[own])
        squares += np.sum(missed**2)
        if effector:
            squares += np.sum(np.einsum("nkm,nm->nk", maps[own], missed[:, :2]) ** 2)
    x = in_search_units(LABELLED)
    priors = [SCALE_PRIOR, SCALE_PRIOR, *PRIORS.values()]
    apart = [(value - p.mean) / p.deviation for value, p in zip(x, priors, strict=True)]
    expected = 0.5 * TAKES * np.log(squares) + 0.5 * problem.strength * np.sum(np.square(apart))
    found = loss_of(problem, LABELLED).value_and_slope(x)[0]
    assert found == pytest.approx(expected, rel=1e-10)
    single = replace(problem, samples=replace(laid, groups=np.arange(50)))
    assert abs(loss_of(single, LABELLED).value_and_slope(x)[0] - expected) > 0.1


@pytest.mark.parametrize("degree", [0, 1])
@pytest.mark.parametrize("covariance", COVARIANCES)
def test_gradient_of_the_loss_is_that_of_finite_differences(
    samples, people, rng, covariance, degree
):
    """All parameters of the pose; nugget, offset and trend of quantities that share the rest."""
    maps = rng.normal(size=(50, 3, 4))
    problem = TuningProblem(labelled(samples, people), rng.normal(size=(50, 6)), effector=maps)
    hyper = replace(LABELLED, covariance=covariance, drifts=(degree,))
    for names, own_scales in ((ALL, True), (BESIDE, False)):
        loss = loss_of(problem, hyper, names, own_scales)
        x = in_search_units(hyper, names)[0 if own_scales else 2 :]
        steps = 1e-5 * np.eye(len(x))
        values = [[loss.value_and_slope(x + s * step)[0] for s in (1, -1)] for step in steps]
        expected = np.array([(after - before) / 2e-5 for after, before in values])
        slope = loss.value_and_slope(x)[1]
        assert np.abs(slope - expected).max() < 1e-6 * np.abs(expected).max()
        # Negative control: a little beside, the slope is another.
        assert np.abs(loss.value_and_slope(x + 0.05)[1] - expected).max() > 1e-3


def test_the_tuned_loss_is_no_greater_than_around_it_and_at_other_starts(samples, people, rng):
    values = own_ways(samples, people, rng, 0.5)
    problem = TuningProblem(labelled(samples, people), values)
    found = in_search_units(tuned_for(samples, people, values).hyper)
    loss = loss_of(problem, LABELLED)
    least = loss.value_and_slope(found)[0]
    bounds = np.array([(p.low, p.high) for p in loss.priors]).T
    for _ in range(40):
        near = np.clip(found + 0.3 * rng.normal(size=len(found)), *bounds)
        assert loss.value_and_slope(near)[0] > least - 1e-6
    for scale in (0.15, 0.7, 2.5):
        for nugget in (0.005, 0.3, 5.0):
            start = replace(LABELLED, scales=np.full(2, scale), nugget=nugget)
            assert loss.value_and_slope(in_search_units(start))[0] > least


def test_the_prior_decides_where_data_do_not(samples, rng):
    """Of a control that changes nothing the scale is small; of few samples it is the prior's."""
    problem = TuningProblem(alone(samples[:4]), rng.normal(size=(4, 1)))
    few = kriging_tuning.tune(problem, "matern52", None).hyper
    strong = kriging_tuning.tune(replace(problem, strength=1e6), "matern52", None).hyper
    expected = [SCALE_PRIOR.mean] * 2 + [PRIORS[name].mean for name in ("nugget", "trend")]
    at = in_search_units(strong, NO_LABELS)
    assert np.abs(at - expected).max() < 1e-3
    deviations = [SCALE_PRIOR.deviation] * 2 + [PRIORS[n].deviation for n in ("nugget", "trend")]
    near = np.abs(in_search_units(few, NO_LABELS) - expected) / deviations
    assert near.max() < 1.5
    # Negative control: fifty samples of a fast wave decide against the prior.
    many = tuned_at(samples, wave(samples)).hyper
    assert np.log(many.nugget) < PRIORS["nugget"].mean - 1.5 * PRIORS["nugget"].deviation


def test_given_nugget_is_kept(samples):
    values = wave(samples)
    tuned = tuned_at(samples, values, 0.037)
    assert tuned.hyper.nugget == 0.037
    assert tuned_at(samples, values).hyper.nugget != 0.037


def test_groups_are_left_out_together(samples, people, rng):
    values = own_ways(samples, people, rng, 1.0)
    laid = labelled(samples, people)
    found = kriging_tuning.evaluate_fixed(LABELLED, laid, values)
    residuals = kriging_model.leave_out(LABELLED, laid.points, people[1]) @ values
    assert np.max(np.abs(found.residuals - residuals)) < 1e-9
    from_mean = np.empty((50, 2))
    for recording in range(TAKES):
        own = people[1] == recording
        from_mean[own] = values[own] - values[~own].mean(axis=0)
    assert abs(found.unexplained - np.sum(residuals**2) / np.sum(from_mean**2)) < 1e-9
    single = kriging_tuning.evaluate_fixed(
        LABELLED, SamplePoints(laid.points, 2, np.arange(50), (PEOPLE,)), values
    )
    assert np.max(np.abs(single.residuals - residuals)) > 1e-2
    assert abs(single.unexplained - found.unexplained) > 1e-3


def test_performers_who_move_differently_get_offsets(samples, people, rng):
    values = own_ways(samples, people, rng, 1.0)
    apart = tuned_for(samples, people, values)
    alike = tuned_for(samples, people, own_ways(samples, people, rng, 0.0))
    assert apart.hyper.labels[0].offset > 3.0 * alike.hyper.labels[0].offset
    unlabelled = TuningProblem(SamplePoints(samples, 2, people[1]), values)
    blind = kriging_tuning.tune(unlabelled, "matern52", None)
    assert apart.unexplained < 0.5 * blind.unexplained


def test_quantities_beside_share_scales_and_correlation(samples, people, rng):
    problem = TuningProblem(labelled(samples, people), own_ways(samples, people, rng, 0.5))
    found = kriging_tuning.tune_beside(problem, LABELLED).hyper
    own = {name[0]: value_of(found, name) for name in BESIDE}
    expected = vary(LABELLED, **own)
    assert np.array_equal(found.scales, expected.scales)
    # The fields but the scales: Python 3.13 compares arrays of two data classes by their values.
    assert replace(found, scales=()) == replace(expected, scales=())
    assert all(own[name[0]] != value_of(LABELLED, name) for name in BESIDE)
    without = kriging_tuning.tune_beside(problem, replace(LABELLED, drifts=(1,), trend=0.0)).hyper
    assert without.trend == 0.0 and without.drifts == (1,)
