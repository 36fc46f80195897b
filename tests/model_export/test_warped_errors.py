"""Tests of leave-one-out errors of whole motions, compared after time warping."""

import numpy as np
import pytest

from posefield_train.graph import warped_errors
from posefield_train.tensor.motion_tensor import FRAMES, UNIFORM_SHARES


def swing(times, size=0.4):
    """Positions (F, 3, 3) of a hand that swings about a root that walks, at times (F,)."""
    root = np.stack([times, 0.0 * times, 0.0 * times], axis=1)
    hand = root + size * np.stack([np.sin(5.0 * times), np.cos(5.0 * times), times**2], axis=1)
    return np.stack([root, 0.5 * (root + hand), hand], axis=1)


LATE = UNIFORM_SHARES + 0.08 * np.sin(np.pi * UNIFORM_SHARES) ** 2
"""The same start and end, up to 8 % of the duration ahead between."""


def test_what_is_late_alone_is_no_error_and_what_is_elsewhere_is():
    captured = np.stack([swing(UNIFORM_SHARES)] * 3)
    elsewhere = swing(UNIFORM_SHARES) + np.array([0.1, 0.0, 0.0])
    predicted = np.stack([swing(UNIFORM_SHARES), swing(LATE), elsewhere])
    found = np.sqrt(warped_errors.mean_squared_errors(captured, predicted))
    unwarped = np.sqrt(np.mean(np.sum(np.square(predicted - captured), axis=-1), axis=(1, 2)))
    assert found[0] < 1e-9
    # Whole frames are matched: within half a frame's way of two metres a second.
    assert found[1] < 0.02 and unwarped[1] > 3.0 * found[1]
    # Negative control: a difference in space stays whole.
    assert found[2] == pytest.approx(0.1, rel=1e-6)


def test_predicted_and_captured_positions_of_a_model_are_those_of_its_clips(trained):
    """Without residuals the prediction is the clip: what is left is resampling and smoothing."""
    timing, values = trained.model.timing, trained.values
    captured = warped_errors.captured_positions(trained.examples)
    assert captured.shape[:2] == (len(trained.examples), FRAMES)
    given = timing, trained.tensor, trained.model.proportions
    parents = trained.skeleton.parents
    exact = warped_errors.predicted_positions(
        *given, trained.full.slices(trained.full.motions), values, parents
    )
    resampled = np.sqrt(warped_errors.mean_squared_errors(captured, exact))
    assert resampled.max() < 0.02
    left_out = {name: values[name] - own for name, own in trained.residuals.items()}
    slices = trained.full.slices(trained.full.motions - trained.pose.residuals)
    predicted = warped_errors.predicted_positions(*given, slices, left_out, parents)
    found = warped_errors.mean_squared_errors(captured, predicted)
    assert np.abs(found / trained.warped_errors - 1.0).max() < 1e-6
    assert found.mean() < trained.left_out_errors.mean()
    assert np.sqrt(found.mean()) > 2.0 * np.sqrt(np.mean(resampled**2))
