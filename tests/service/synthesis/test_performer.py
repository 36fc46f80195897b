"""Tests of performers: selection by name, and the error for unknown names."""

import numpy as np
import pytest

from posefield.common.errors import InvalidField
from posefield.question.motion_question import ClipQuestion, PoseQuestion
from posefield.registry import model_registry
from posefield.synthesis import clips, poses

POINT = {"stature": 1.75, "hip_height": 0.9, "turn": 10.0, "target_height": 1.0}
NAMES = ("middle", "short", "tall")


@pytest.fixture(scope="module")
def model(labelled_path):
    return model_registry.load([labelled_path]).models["labelled"]


@pytest.fixture(scope="module")
def plain(model_path):
    return model_registry.load([model_path]).models["reaching"]


# A pose is asked for twice: alone it would be summed in another order.
TWICE = np.array([[0.5], [0.5]])


def test_the_answer_for_a_name_is_that_of_its_label(model):
    point = np.array([[POINT[c.name] for c in model.session.card.controls]])
    for name, label in zip(NAMES, np.eye(3), strict=True):
        answer = poses.synthesize_poses(
            model, PoseQuestion(controls=POINT, times=[0.5], performer=name)
        )
        rotations = [
            model.session.run(point.repeat(2, 0), TWICE, "rotations", labels=labels)[0][0, 0]
            for labels in (np.tile(label, (2, 1)), np.tile(np.roll(label, 1), (2, 1)))
        ]
        assert np.array_equal(answer.rotations[0], rotations[0])
        assert not np.array_equal(answer.rotations[0], rotations[1])


HINT = " (did you mean 'tall'?)"


@pytest.mark.parametrize(
    ("name", "hint"),
    [("Tall", HINT), ("", ""), ("nobody", "")],
)
def test_an_unknown_performer_is_refused_with_those_there_are(model, name, hint):
    for ask in (
        lambda: poses.synthesize_poses(
            model, PoseQuestion(controls=POINT, times=[0.0], performer=name)
        ),
        lambda: clips.synthesize_clip(
            model, ClipQuestion(controls=POINT, fps=30.0, extrapolate="warn", performer=name)
        ),
    ):
        with pytest.raises(InvalidField) as caught:
            ask()
        assert caught.value.field == "performer"
        assert caught.value.message == f"{name!r}{hint}, expected one of middle, short, tall"


def test_a_model_that_knows_nobody_refuses_every_name(plain):
    with pytest.raises(InvalidField) as caught:
        poses.synthesize_poses(plain, PoseQuestion(controls=POINT, times=[0.0], performer="tall"))
    assert caught.value.field == "performer"
    assert caught.value.message == "'tall', expected none: this model knows none"
    assert (
        poses.synthesize_poses(plain, PoseQuestion(controls=POINT, times=[0.0])).trust.performer
        is None
    )
