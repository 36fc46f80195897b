"""Tests of performers: selection by name, and the error for unknown names."""

import numpy as np
import pytest

from posefield.common.errors import InvalidField
from posefield.encode.formats import CLIP_ENCODERS, POSE_ENCODERS
from posefield.question.motion_question import ClipQuestion, PoseQuestion
from posefield.registry import model_registry
from posefield.synthesis import clips, poses

POINT = {"stature": 1.75, "hip_height": 0.9, "turn": 10.0, "target_height": 1.0}
NAMES = ("middle", "short", "tall")
# The graph answers in float32, and sums a batch in another order than one row.
FLOAT32 = 1e-5


@pytest.fixture(scope="module")
def model(labelled_path):
    return model_registry.load([labelled_path]).models["labelled"]


@pytest.fixture(scope="module")
def plain(model_path):
    return model_registry.load([model_path]).models["reaching"]


def differ(a, b):
    return max(
        np.abs(a.rotations - b.rotations).max(), np.abs(a.bone_offsets - b.bone_offsets).max()
    )


def test_performers_move_each_in_their_own_way(model):
    asked = (PoseQuestion(controls=POINT, times=[0.5], performer=name) for name in (*NAMES, None))
    found = [poses.synthesize_poses(model, each) for each in asked]
    for i, one in enumerate(found):
        for other in found[:i]:
            assert differ(one, other) > 10 * FLOAT32
        assert one.trust.performer == (*NAMES, None)[i]


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


def test_whether_a_performer_was_seen_is_said_where_any_are_told_apart(model, plain):
    asked = (PoseQuestion(controls=POINT, times=[0.5], performer=who) for who in ("tall", None))
    seen = [poses.synthesize_poses(model, each).trust.facts() for each in asked]
    assert [facts["performer_seen"] for facts in seen] == [True, False]
    assert seen[0]["warnings"] == seen[1]["warnings"]
    assert (
        "performer_seen"
        not in poses.synthesize_poses(
            plain, PoseQuestion(controls=POINT, times=[0.5])
        ).trust.facts()
    )


def test_nobody_is_asked_for_unless_somebody_is(model):
    silent = poses.synthesize_poses(model, PoseQuestion(controls=POINT, times=[0.5]))
    nobody = poses.synthesize_poses(
        model, PoseQuestion(controls=POINT, times=[0.5], performer=None)
    )
    assert differ(silent, nobody) == 0.0
    assert silent.trust == nobody.trust
    assert silent.trust.performer is None


def test_a_clip_is_the_poses_of_its_performer(model):
    clip = clips.synthesize_clip(
        model, ClipQuestion(controls=POINT, fps=30.0, extrapolate="warn", performer="tall")
    )
    asked = (
        PoseQuestion(controls=POINT, times=[0.5], performer=name) for name in ("tall", "short")
    )
    pose, other = (poses.synthesize_poses(model, each) for each in asked)
    assert clip.trust == pose.trust
    assert clip.trust.duration != other.trust.duration
    assert np.abs(clip.clip.rotations[15] - pose.rotations[0]).max() < FLOAT32
    assert np.abs(clip.clip.rotations[15] - other.rotations[0]).max() > 10 * FLOAT32


HINT = " (did you mean 'tall'?)"


@pytest.mark.parametrize(
    ("name", "hint"),
    [("Tall", HINT), ("", ""), (" tall", HINT), ("nobody", ""), ("tall, short", "")],
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


def test_json_says_who_was_asked_for_and_usd_where_it_was_somebody(model):
    for name, said in (("tall", b'"performer":"tall"'), (None, b'"performer":null')):
        pose = poses.synthesize_poses(
            model, PoseQuestion(controls=POINT, times=[0.0], performer=name)
        )
        assert said in POSE_ENCODERS["json"].encode(pose)
        clip = clips.synthesize_clip(
            model, ClipQuestion(controls=POINT, fps=30.0, extrapolate="warn", performer=name)
        )
        assert said in CLIP_ENCODERS["json"].encode(clip)
        assert (b'string performer = "tall"' in CLIP_ENCODERS["usda"].encode(clip)) == bool(name)
