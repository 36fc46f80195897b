"""Tests of leave-one-out predictions in the report, and of their drawing."""

import numpy as np
import pytest

from posefield_train.align import time_alignment
from posefield_train.kriging import universal_kriging
from posefield_train.report import clip_errors

# Two ways to one solution of the same equations differ by rounding, m.
ROUNDING = 1e-8
# A change that would be seen in a drawing, m.
SEEN = 1e-3


def slices(trained):
    """Whole motions as rows (N, D' T) of the tensor, truncated nowhere."""
    return trained.tensor.values.transpose(2, 0, 1).reshape(len(trained.examples), -1)


def predicted(trained, kept, clip):
    """Slice (D', T) at a clip's controls by kriging from the kept clips, nothing tuned anew."""
    samples = trained.model.bank.pose.samples
    field = universal_kriging.solve(trained.pose.hyper, samples[kept], slices(trained)[kept])
    return field.predict(samples[[clip]]).reshape(trained.tensor.values.shape[:2])


@pytest.fixture(scope="module", params=["worst", "last"])
def clip(request, trained):
    return {
        "worst": int(np.argmax(trained.left_out_errors)),
        "last": len(trained.left_out_errors) - 1,
    }[request.param]


def test_a_clip_is_predicted_from_all_others_and_not_from_itself(trained, clip):
    everyone = np.arange(len(trained.examples))
    found = clip_errors.predicted_motion(trained, clip)
    alone = predicted(trained, everyone[everyone != clip], clip)
    assert np.abs(found - alone).max() < ROUNDING
    # Negative control: with the clip itself the prediction is another.
    assert np.abs(found - predicted(trained, everyone, clip)).max() > SEEN
    # Negative control: so it is where one more clip is missing.
    fewer = everyone[(everyone != clip) & (everyone != (clip + 1) % len(everyone))]
    assert np.abs(found - predicted(trained, fewer, clip)).max() > 100 * ROUNDING


def test_the_body_drawn_as_captured_is_the_aligned_clip(trained, clip):
    offsets = np.stack([example.offsets for example in trained.examples])
    expected = time_alignment.joint_positions(trained.aligned, trained.skeleton.parents, offsets)[
        clip
    ]
    count = len(trained.skeleton)
    body = clip_errors.body_points(trained, clip, trained.tensor.values[:, :, clip])
    assert np.abs(body[:, :count] - expected).max() < ROUNDING
    guess = clip_errors.body_points(trained, clip, clip_errors.predicted_motion(trained, clip))
    assert np.abs(guess[:, :count] - expected).max() > SEEN
