"""Tests of events at moments that are found in each clip: highest, lowest, farthest."""

from dataclasses import replace

import numpy as np
import pytest
from minimal import SKELETON, ingested, recipe_with, write_clips

import posefield_train
from posefield.common.errors import RecipeError
from posefield.motion import quat
from posefield.motion.clip import assemble
from posefield.motion.measures import Measure
from posefield_train import training
from posefield_train.adapt import model_reconstruction, new_clips
from posefield_train.graph import onnx_export
from posefield_train.tensor import truncation_error

FRAMES, HAND = 41, SKELETON.names.index("LeftHand")
EVENT = {"event": {"joint": "LeftHand", "at": "highest"}}


def raised(peak, height, frames=FRAMES):
    """A clip whose hand is highest at the share `peak`, by an angle of `height`."""
    t = np.linspace(0.0, 1.0, frames)
    lifted = height * np.sin(np.pi * np.interp(t, [0.0, peak, 1.0], [0.0, 0.5, 1.0]))
    rotations = np.tile(quat.IDENTITY, (frames, len(SKELETON), 1))
    rotations[:, 3] = quat.from_axis_angle(np.array([0.0, 0.0, 1.0]), lifted)
    path = np.stack([0 * t, 0.9 + 0 * t, 0.1 * t], axis=-1)
    return assemble(SKELETON, rotations, path, SKELETON.offsets, 30.0)


PEAKS = tuple((12 + i) / (FRAMES - 1) for i in range(8))
LIFTED = tuple(raised(peak, 0.6 + 0.1 * i) for i, peak in enumerate(PEAKS))


@pytest.fixture
def read(tmp_path):
    """Function that writes clips and their table, and returns the recipe and its examples."""
    return lambda *given, **sections: ingested(tmp_path, *given, **sections)[:2]


def test_the_highest_place_is_a_landmark_that_is_aligned(read):
    recipe, examples = read(LIFTED, **EVENT)
    assert [example.landmarks[0] for example in examples] == pytest.approx(PEAKS)
    trained = training.train_examples(recipe, examples)
    moment = truncation_error.event_frame(recipe, trained.examples)
    assert (moment.joint, moment.frame) == (HAND, round(19 * np.mean(PEAKS)))
    heights = trained.aligned.rotations[:, :, 3, 3]
    assert np.abs(np.argmax(heights, axis=1) - moment.frame).max() <= 1
    card = onnx_export.export_model(trained).card
    assert card.making.landmarks == {"highest": pytest.approx(np.mean(PEAKS), abs=1e-6)}
    assert card.event.share == pytest.approx(np.mean(PEAKS), abs=1e-4)


def test_a_moment_at_the_end_of_a_clip_is_refused_by_line(read):
    half = LIFTED[3]
    cut = replace(half, rotations=half.rotations[:12], translations=half.translations[:12])
    with pytest.raises(RecipeError) as refused:
        read([*LIFTED[:3], cut], **EVENT)
    assert refused.value.line == 5
    assert refused.value.message == (
        "LeftHand is highest at the end of 3.bvh, expected a moment within the clip: cut it "
        "longer, set event.at to 'end', or name a column of clips.landmarks"
    )


def test_a_new_performers_clips_are_aligned_by_the_same_moment(read, tmp_path):
    clips = [raised(peak, 0.6 + 0.1 * (i // 2)) for i, peak in enumerate(PEAKS)]
    control = {"name": "lift", "auto": {"quantity": "height", "joint": "LeftHand", "at": "highest"}}
    own = recipe_with(clips={"performer": "who"}, kriging={"label": "performer"}, **EVENT)
    plain = own.model_dump(by_alias=True, exclude_unset=True)
    plain["controls"] = [{**control, "description": "Height of the hand"}]
    recipe = type(own).model_validate(plain)
    rows = [f"{i}.bvh,{i},{'ab'[i % 2]}" for i in range(8)]
    write_clips(tmp_path, clips)
    (tmp_path / "clips.csv").write_text("\n".join(["file,v,who", *rows]) + "\n")
    trained = posefield_train.train(recipe, tmp_path)
    content = onnx_export.export_model(trained).content
    reopened = model_reconstruction.reconstruct(content, "a model")
    (tmp_path / "new").mkdir()
    write_clips(tmp_path / "new", [raised(0.6, 0.9)])
    found, _ = new_clips.examples_of_files(
        reopened, [tmp_path / "new" / "0.bvh"], recipe.source, {"performer": "c"}
    )
    assert found[0].landmarks == (pytest.approx(0.6),)
    assert reopened.card.controls[0].measure == Measure("height", (HAND,), "highest")
