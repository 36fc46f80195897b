"""Tests of the effect of coefficients on the joint of the event."""

import numpy as np
import pytest

from posefield_train.tensor import event_blend, truncation_error
from posefield_train.tensor.event_blend import COEFFICIENTS


@pytest.fixture(scope="module")
def judge(small_recipe, trained):
    return truncation_error.truncation_reference(small_recipe, trained.examples, trained.tensor)


def at_event(judge, full, motions):
    """Positions (N, 3) of the event's joint by forward kinematics of whole motions."""
    whole = truncation_error.positions(
        judge.own_tensor, full.slices(motions), judge.parents, judge.offsets
    )
    return whole[:, judge.event_frame.frame, judge.event_frame.joint]


def test_jacobian_is_that_of_central_differences_of_forward_kinematics(judge, trained):
    full, event = trained.full, judge.event_frame
    found = event_blend.event_jacobians(judge, full, event)
    assert found.shape == (len(trained.examples), 3, COEFFICIENTS)
    step = 1e-3 * full.motions[:, 0].std()
    for column in (0, 3, COEFFICIENTS - 1):
        either = [full.motions.copy() for _ in range(2)]
        either[0][:, column] += step
        either[1][:, column] -= step
        after, before = (at_event(judge, full, own) for own in either)
        expected = (after - before) / (2.0 * step)
        # Forward differences of 2 % of a deviation: the curvature's share is left.
        assert np.abs(found[:, :, column] - expected).max() < 0.03 * np.abs(expected).max()
        other = found[:, :, (column + 1) % COEFFICIENTS]
        assert np.abs(other - expected).max() > 0.3 * np.abs(expected).max()


def test_errors_are_the_way_that_residuals_move_the_joint(judge, trained):
    full, residuals = trained.full, trained.pose.residuals
    found = event_blend.event_distances(judge, full, judge.event_frame, residuals)
    there, predicted = (at_event(judge, full, full.motions - r) for r in (0.0, residuals))
    assert np.abs(found - np.linalg.norm(there - predicted, axis=1)).max() < 1e-9
    assert not event_blend.event_distances(judge, full, judge.event_frame, 0.0 * residuals).any()
    # To first order the leading coefficients tell most of it.
    jacobian = event_blend.event_jacobians(judge, full, judge.event_frame)
    linear = np.einsum("nkm,nm->nk", jacobian, residuals[:, :COEFFICIENTS])
    gaps = np.linalg.norm(linear, axis=1) - found
    assert np.sqrt(np.mean(gaps**2)) < 0.5 * np.sqrt(np.mean(found**2))
