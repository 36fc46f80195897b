"""Tests of small families and of skeletons of one joint and of hundreds: models and reports."""

import json

import numpy as np
import pytest
from minimal import recipe_with, small_clip, write_clips

import posefield_train
from posefield.encode.formats import CLIP_ENCODERS
from posefield.inference import session
from posefield.motion import quat
from posefield.motion.clip import assemble
from posefield.motion.skeleton import Skeleton
from posefield.question.motion_question import ClipQuestion
from posefield.synthesis import clips
from posefield.synthesis.synthesizer import Synthesizer
from posefield_train.graph import onnx_export
from posefield_train.report import levels_of_detail, training_report

BRANCHES = 8


def creature(joints):
    """A root with some chains of bones of 5 cm."""
    number = np.arange(joints)
    offsets = np.column_stack([0.01 * (number % BRANCHES - 3), 0.05 + 0.0 * number, 0.0 * number])
    offsets[0] = 0.0
    parents = (-1, *(max(0, joint - BRANCHES) for joint in range(1, joints)))
    names = tuple(f"j{joint}" for joint in range(joints))
    return Skeleton(names, parents, offsets, (), np.zeros((0, 3)))


def clip(joints, value):
    t = np.linspace(0.0, 1.0, 25)
    own = creature(joints)
    phases = 0.3 * value + np.arange(3 * joints).reshape(joints, 3)
    rotations = quat.exp((0.2 + 0.05 * value) * np.sin(4.0 * t[:, None, None] + phases))
    path = np.stack([0.2 * value * t, 0.5 + 0.1 * value * np.sin(3.0 * t), 0.5 * t], axis=-1)
    return assemble(own, rotations, path, own.offsets, 30.0)


@pytest.mark.parametrize("joints", [1, 2, pytest.param(200, marks=pytest.mark.system)])
def test_a_skeleton_of_any_size_trains_and_is_written(tmp_path, joints):
    family = [clip(joints, value) for value in range(8)]
    folder = write_clips(tmp_path / "clips", family)
    own = recipe_with(motion={"facing": "none"})
    trained = posefield_train.train(own, folder)
    exported = onnx_export.export_model(trained)
    model = Synthesizer("tiny", session.open_bytes(exported.content, "tiny"))
    answer = clips.synthesize_clip(model, ClipQuestion(controls={"speed": 3.0}, fps=30.0))
    assert len(answer.clip.skeleton) == joints and trained.notes == ()
    # The clip in the middle was seen.
    wanted = trained.examples[3].clip.positions()
    assert np.abs(answer.clip.positions()[-1] - wanted[-1]).max() < 0.05
    for encoder in CLIP_ENCODERS.values():
        if not encoder.is_humanoid:
            assert len(encoder.encode(answer)) > 500


def test_a_family_of_one_control_and_no_performers_has_a_report(tmp_path):
    clips = [small_clip(0.3 * np.sin(i), 21 + i % 3) for i in range(8)]
    recipe = recipe_with(motion={"cyclic": True})
    trained = posefield_train.train(recipe, write_clips(tmp_path, clips))
    exported = onnx_export.export_model(trained)
    levels = levels_of_detail.time_levels(exported)
    facts = json.loads(training_report.render(trained, exported, levels, []).json)
    assert [level["effector_m"] for level in facts["levels"]["levels"]] == [None] * 4
    assert "travel" in facts["fields"]
    assert facts["coverage"]["one_value_a_performer"] == []
    assert [clip["performer"] for clip in facts["clips"]["clips"]] == [""] * 8
