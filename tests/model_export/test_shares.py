"""Tests of each joint's share of the error."""

from dataclasses import replace

import numpy as np
import pytest

from posefield_train import train
from posefield_train.tensor import truncation_error


@pytest.fixture
def judge(small_recipe, trained):
    return truncation_error.truncation_reference(small_recipe, trained.examples, trained.tensor)


def test_squares_average_to_one_and_hands_err_more_than_hips(judge, trained):
    found = train.joint_error_shares(judge, trained.full, trained.pose, None)
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
    found = train.joint_error_shares(judge, trained.full, trained.pose, None)
    assert found == pytest.approx(expected, rel=1e-6)
    # Negative control: with all clips counted alike it would be another.
    assert found != pytest.approx(np.sqrt(plain / plain.mean()), rel=1e-4)


def test_travel_moves_all_joints_alike(judge, trained):
    far = np.full((len(trained.examples), 3), 100.0)
    found = train.joint_error_shares(judge, trained.full, trained.pose, far)
    assert np.ptp(found) < 0.01 < np.ptp(trained.joints)


def test_what_is_met_exactly_errs_evenly(judge, trained):
    met = replace(trained.pose, residuals=np.zeros_like(trained.pose.residuals))
    found = train.joint_error_shares(judge, trained.full, met, None)
    assert np.array_equal(found, np.ones(len(trained.skeleton)))
