"""Curves as rows of the tensor: their metric, timing and answers, with and without a skeleton."""

from dataclasses import replace

import numpy as np
import pytest
from families import face_motion

from posefield.common.errors import ModelError
from posefield.constraints import gauss_newton
from posefield.inference import onnx_runtime, session
from posefield.model_file import model_card
from posefield.motion import quat
from posefield.question.motion_question import ClipQuestion
from posefield.synthesis import clips, poses
from posefield.synthesis.synthesizer import Synthesizer

LAUGH, CALM = {"smile": 0.7, "openness": 0.5}, {"smile": 0.2, "openness": 0.5}
# Trials vary by 1 %. A blink lasts a tenth of the clip, so most of its error is of timing.
NEAR = 0.04
# The graph computes in float32.
SINGLE = 1e-5


@pytest.fixture(scope="session")
def face(models_trained):
    return models_trained.trained("face")


@pytest.fixture(scope="session")
def alone(models_trained):
    return models_trained.trained("curves")


@pytest.fixture(scope="session", params=["face", "curves"])
def opened(models_trained, request):
    """A model with curves, with a skeleton and without."""
    content = models_trained.exported(request.param).content
    return Synthesizer(request.param, session.open_bytes(content, request.param))


def truth(controls, clip):
    shares = np.minimum(np.arange(len(clip)) / clip.rate / clip.duration, 1.0)
    return face_motion.curve_values(controls["smile"], controls["openness"], shares)


def test_an_expression_between_the_examples_is_near_the_truth(opened):
    clip = clips.synthesize_clip(opened, ClipQuestion(controls=LAUGH, fps=60.0)).clip
    assert clip.curves.names == list(face_motion.CURVE_NAMES)
    away = np.sqrt(np.mean(np.square(clip.curve_values - truth(LAUGH, clip)), axis=0))
    assert away.max() < NEAR
    other = np.sqrt(np.mean(np.square(clip.curve_values - truth(CALM, clip)), axis=0))
    assert other.max() > 4 * NEAR


def test_answers_are_clamped_to_the_range_of_the_curves(opened):
    asked = ClipQuestion(controls={"smile": 1.2, "openness": 1.2}, fps=60.0, extrapolate="ok")
    found = clips.synthesize_clip(opened, asked).clip.curve_values
    assert found.max() == 1.0 and found.min() == 0.0


def test_the_graph_computes_the_curves_of_the_reference(models_trained, opened):
    model = models_trained.exported(opened.name).model
    points, times = np.array([[0.3, 0.4], [0.8, 0.7]]), np.array([[0.2, 0.7], [0.4, 0.9]])
    for level in range(len(opened.session.card.levels)):
        expected = model.evaluate(points, times, level=level).curves
        (found,) = opened.session.run(points, times, onnx_runtime.CURVES, level=level)
        assert np.abs(found - expected).max() < SINGLE
        assert np.abs(found[::-1] - expected).max() > 0.05


def test_the_solver_predicts_the_curves_of_the_graph(opened):
    own, times = opened.session, np.linspace(0.0, 0.9, 7)
    for level in range(len(own.card.levels)):
        state = own.state(np.array([[0.7, 0.5]]), times, level=level)
        predicted = gauss_newton.build_corrector(own, level).predict(state)
        (expected,) = own.run(np.array([[0.7, 0.5]]), times[None], onnx_runtime.CURVES, level=level)
        assert np.abs(predicted.curve_values(state.frames) - expected[0]).max() < SINGLE


def test_a_pose_with_curves_has_the_same_bytes_in_every_batch(opened):
    assert all(poses.is_batch_exact(opened, level) for level in range(4))


def test_curves_follow_the_warp_of_their_clip(face):
    """The jaw turns and the mouth opens by the same law, before the alignment and after."""
    jaw = face.skeleton.names.index("Jaw")
    turned = np.linalg.norm(quat.log(face.aligned.rotations[:, :, jaw]), axis=-1)
    opened = face.aligned.curves[:, :, face_motion.CURVE_NAMES.index("jawOpen")]
    strengths = opened[:, -1] / turned[:, -1]
    assert np.abs(opened - strengths[:, None] * turned).max() < NEAR
    # Of another clip, whose warp differs, the same does not hold.
    mixed = np.roll(turned, 1, axis=0) * (turned[:, -1] / np.roll(turned[:, -1], 1))[:, None]
    assert np.abs(opened - strengths[:, None] * mixed).max() > NEAR


@pytest.mark.parametrize(
    "change, said",
    [
        (lambda own: (replace(own[0], minimum=1.0, maximum=0.0), *own[1:]), "below the maximum"),
        (lambda own: own[1:], "constant 'freedoms' has shape"),
    ],
)
def test_a_card_whose_curves_contradict_it_is_refused(models_trained, change, said):
    made = models_trained.exported("face")
    card = replace(made.card, curves=change(made.card.curves))
    content = made.model.onnx(model_card.dump(card), {"producer_name": "t"})
    with pytest.raises(ModelError, match=said):
        session.open_bytes(content, "face")
