"""Tests of the takes and standing feet of held-out clips, and of their figures."""

import numpy as np
import pytest
from evaluation import field_statistics, standing_feet, takes
from families import sample_walk

from posefield.inference import session
from posefield.question.motion_question import ClipQuestion
from posefield_train.evaluate.protocol import Fold
from posefield_train.graph import onnx_export
from posefield_train.training import train_examples

HELD = (0, 1, 2)


@pytest.fixture(scope="module")
def file(strides):
    """A model of the strides but three."""
    rest, _ = Fold(HELD).split(strides)
    recipe = sample_walk.recipe()
    return onnx_export.export_finest(train_examples(recipe, rest))


@pytest.fixture(scope="module")
def found(strides, file):
    _, held = Fold(HELD).split(strides)
    return takes.take_results("stroll", file, held, HELD)


@pytest.fixture(scope="module")
def weights(file):
    return session.open_bytes(file, "stroll").kriging_weights


def test_fields_are_as_the_model_says_and_their_controls_are_not(weights):
    own = [field_statistics.measure(weights, seed) for seed in range(1, 7)]
    mean = {name: np.mean([getattr(each, name) for each in own], axis=0) for name in vars(own[0])}
    assert np.allclose(mean["variogram"], 1.0, atol=0.1)
    assert mean["variance"] == pytest.approx(1.0, abs=0.1)
    assert mean["mean_error"] < 1.3
    assert not np.allclose(mean["wrong_variogram"], 1.0, atol=0.1)
    assert mean["unconditioned"] > 1.3 and mean["shared_errors"] > 1.3


def test_takes_of_held_out_clips_are_measured_at_the_default_rate(found):
    assert ClipQuestion(controls={}).fps == takes.RATE
    assert len(found.clips) == len(HELD)
    for own in found.clips:
        assert own.take != own.predicted and own.sliding != own.predicted
        assert own.take.weighted_skate < own.sliding.weighted_skate + 1e-3
        # All time functions of a cycle vary, and this model has no detail.
        assert own.unlimited is own.detailed is own.detailed_take is None


@pytest.fixture(scope="module")
def answers(strides, file):
    _, held = Fold(HELD).split(strides)
    return standing_feet.feet_answers("stroll", file, held)


def test_standing_feet_slide_less_and_cost_little(answers):
    assert len(answers) == 3
    for one in answers:
        assert one.standing.weighted_skate < one.predicted.weighted_skate + 1e-3
        assert one.standing_error < one.predicted_error + 0.01
        assert one.standing.lowest > -0.01
        assert 0.0 <= one.lowered <= 0.08
    # Negative control: rules of swings, and not the contacts alone, make feet stand.
    locked, standing = (
        np.mean([getattr(one, name).weighted_skate for one in answers])
        for name in ("locked", "standing")
    )
    assert locked > standing
