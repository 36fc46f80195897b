"""Tests of the true errors of truncation as joint distances, and of the shares that joints have."""

from dataclasses import replace

import numpy as np
import pytest

from posefield.common.errors import TrainingError
from posefield_train import training
from posefield_train.align import time_alignment
from posefield_train.graph import truncation_cost
from posefield_train.source.recipe_sections import Event
from posefield_train.tensor import truncation_error

# Rounding of the kinematics in float64, m.
EXACT = 1e-9


@pytest.fixture(scope="module")
def judge(small_recipe, trained):
    return truncation_error.truncation_reference(small_recipe, trained.examples, trained.tensor)


@pytest.fixture(scope="module")
def reduced(trained):
    return trained.full.truncated((12, 5, 15))


@pytest.fixture(scope="module")
def gaps(trained, judge, reduced):
    """Distances (N, T, J) of that truncation, m."""
    found = truncation_error.positions(
        judge.tensor, reduced.restored(), judge.parents, judge.offsets
    )
    return np.linalg.norm(found - judge.points, axis=-1)


def test_whole_tensor_is_the_aligned_clips(trained, judge):
    clips = time_alignment.joint_positions(trained.aligned, judge.parents, judge.offsets)
    assert np.abs(judge.points - clips).max() < EXACT
    shuffled = time_alignment.joint_positions(trained.aligned, judge.parents, judge.offsets[::-1])
    assert np.abs(judge.points - shuffled).max() > 1e-2


def test_distances_are_those_of_the_joints(judge, reduced, gaps):
    found = judge.evaluate(reduced)
    assert found.rms == pytest.approx(np.sqrt(np.mean(gaps**2)))
    assert found.max == pytest.approx(gaps.max())
    assert np.mean(gaps > found.p99) == pytest.approx(0.01, abs=1e-4)
    assert found.effector == pytest.approx(np.sqrt(np.mean(gaps[:, -1, hand(judge)] ** 2)))


def hand(judge):
    return judge.event_frame.joint


def test_joint_weights_weigh_the_rms_alone(judge, reduced, gaps):
    only = np.zeros(len(judge.weights))
    only[hand(judge)] = 2.0
    found = replace(judge, weights=only).evaluate(reduced)
    assert found.rms == pytest.approx(np.sqrt(np.mean(gaps[..., hand(judge)] ** 2)))
    assert found.rms > 1.1 * judge.evaluate(reduced).rms
    assert (found.p99, found.max) == (judge.evaluate(reduced).p99, judge.evaluate(reduced).max)


def test_without_an_event_there_is_no_effector(small_recipe, trained, reduced):
    plain = small_recipe.model_copy(update={"event": None})
    assert (
        truncation_error.truncation_reference(plain, trained.examples, trained.tensor)
        .evaluate(reduced)
        .effector
        is None
    )
    assert truncation_error.event(plain, trained.examples) is None


def test_an_event_at_a_landmark_is_at_the_mean_of_its_times(small_recipe, trained):
    marks = np.linspace(0.2, 0.6, len(trained.examples))
    marked = [replace(e, landmarks=(0.1, m)) for e, m in zip(trained.examples, marks, strict=True)]
    clips = small_recipe.clips.model_copy(update={"landmarks": ["lift", "touch"]})
    frames, shares = {}, {}
    for at in ("lift", "touch", "end"):
        event = Event(joint="LeftHand", at=at)
        own = small_recipe.model_copy(update={"clips": clips, "event": event})
        frames[at] = truncation_error.truncation_reference(
            own, marked, trained.tensor
        ).event_frame.frame
        told = truncation_error.event(own, marked)
        assert trained.skeleton.names[told.joint] == "LeftHand"
        shares[at] = told.share
    assert frames == {"lift": 4, "touch": 16, "end": 39}
    assert shares == {"lift": 0.1, "touch": 0.4, "end": 1.0}


def test_a_joint_that_is_not_there_is_refused_by_name(small_recipe, trained):
    own = small_recipe.model_copy(update={"event": Event(joint="Tail", at="end")})
    with pytest.raises(TrainingError, match=r"event\.joint 'Tail', expected one of Hips, .*Head"):
        truncation_error.truncation_reference(own, trained.examples, trained.tensor)


def chosen(own, trained, judge, limits=None, **size):
    """Fidelity and cost of the ranks that a size asks for."""
    empty = {"rms_budget_cm": None, "p99_budget_cm": None, "effector_budget_cm": None}
    asked = own.size.model_copy(update={**empty, **size})
    price = truncation_cost.RANK_COSTS[asked.cost](trained.tensor, 4)
    found = truncation_cost.choose_ranks(asked, trained.full, price, judge, limits or {})
    return judge.evaluate(trained.full.truncated(found)), price.evaluate(*found), found


@pytest.mark.parametrize("name", ["rms", "p99", "effector"])
def test_a_budget_is_kept_by_true_distances_and_not_wasted(small_recipe, trained, judge, name):
    looser = {"rms": 1.5, "p99": 4.0, "effector": 2.0}
    found, price, _ = chosen(small_recipe, trained, judge, **{f"{name}_budget_cm": looser[name]})
    assert 0.8 * looser[name] < 100 * getattr(found, name) <= looser[name]
    half = {f"{name}_budget_cm": 0.5 * looser[name]}
    assert chosen(small_recipe, trained, judge, **half)[1] > 1.3 * price


def test_the_smaller_of_a_budget_and_its_limit_is_kept(small_recipe, trained, judge):
    budget = {"rms_budget_cm": 1.5}
    free, cheap, triple = chosen(small_recipe, trained, judge, **budget)
    looser = chosen(small_recipe, trained, judge, {"rms": 0.02}, **budget)
    assert looser == (free, cheap, triple)
    for name in ("rms", "effector"):
        limit = 0.5 * getattr(free, name)
        found, price, _ = chosen(small_recipe, trained, judge, {name: limit}, **budget)
        assert 0.8 * limit < getattr(found, name) <= limit and price > cheap
    operations = truncation_cost.operation_cost(trained.tensor, 4)
    _, price, triple = chosen(small_recipe, trained, judge, **budget, cost="operations")
    assert price == operations.evaluate(*triple)


def test_training_cuts_off_little_beside_what_it_cannot_predict(small_recipe, trained):
    """The prediction of a left-out clip misses more than six times what truncation adds."""
    assert small_recipe.event is not None
    limit = np.sqrt(trained.left_out_errors.mean()) / 6
    assert limit < 0.01 * small_recipe.size.rms_budget_cm
    assert 0.7 * limit < trained.truncation_errors.rms <= limit


def test_squares_average_to_one_and_hands_err_more_than_hips(judge, trained):
    found = training.joint_error_shares(judge, trained.full, trained.pose, None)
    assert np.mean(np.square(found)) == pytest.approx(1.0, abs=1e-3)
    assert found == pytest.approx(trained.joints, rel=1e-9)
    hand, hips = map(trained.skeleton.names.index, ("RightHand", "Hips"))
    assert found[hand] > 1.5 * found[hips]


def test_shares_are_of_distances_to_the_prediction_by_what_is_usual_of_each_clip(judge, trained):
    total = np.zeros(len(trained.skeleton))
    plain = np.zeros_like(total)
    for clip in range(len(trained.examples)):
        one = [clip]
        values = trained.tensor.values[:, :, one]
        predicted = values - trained.full.slices(trained.pose.residuals[one])
        places = [
            truncation_error.positions(trained.tensor, each, judge.parents, judge.offsets[one])[0]
            for each in (values, predicted)
        ]
        squares = np.mean(np.sum(np.square(places[0] - places[1]), axis=-1), axis=0)
        total += squares / trained.pose.variances[clip]
        plain += squares
    expected = np.sqrt(total / total.mean())
    found = training.joint_error_shares(judge, trained.full, trained.pose, None)
    assert found == pytest.approx(expected, rel=1e-6)
    # Negative control: with all clips counted alike it would be another.
    assert found != pytest.approx(np.sqrt(plain / plain.mean()), rel=1e-4)


def test_travel_moves_all_joints_alike(judge, trained):
    far = np.full((len(trained.examples), 3), 100.0)
    found = training.joint_error_shares(judge, trained.full, trained.pose, far)
    assert np.ptp(found) < 0.01 < np.ptp(trained.joints)


def test_what_is_met_exactly_errs_evenly(judge, trained):
    met = replace(trained.pose, residuals=np.zeros_like(trained.pose.residuals))
    found = training.joint_error_shares(judge, trained.full, met, None)
    assert np.array_equal(found, np.ones(len(trained.skeleton)))
