"""Tests that new clips of a performer are normalized as the family's were."""

from dataclasses import replace

import numpy as np
import pytest
from families import quadruped_walk

import posefield_train
from posefield.common.units import UP
from posefield.motion import bvh_writer, quat
from posefield.motion.clip import Clip
from posefield.motion.skeleton import Skeleton
from posefield_train.adapt import model_reconstruction, new_clips
from posefield_train.sample import sample_files
from posefield_train.source import ingest, motion_readers, recipe

WOLF = {"performer": "wolf"}


@pytest.fixture(scope="module")
def family(tmp_path_factory):
    """Recipe, examples and model file of the quadruped, whose files face -x."""
    folder = tmp_path_factory.mktemp("family") / "quadruped"
    own = recipe.read(sample_files.write_folder(folder, quadruped_walk.files()))
    trained = posefield_train.train(own, folder)
    posefield_train.export(trained, folder / "model.onnx")
    return own, trained.examples, folder / "model.onnx"


def below_a_dummy(clip):
    """The clip below a static root."""
    own, frames = clip.skeleton, len(clip)
    joints = Skeleton(
        ("World", *own.names),
        (-1, *(parent + 1 for parent in own.parents)),
        np.vstack([0.0 * UP, own.offsets]),
        tuple(joint + 1 for joint in own.tip_joints),
        own.tip_offsets,
    )
    still = np.tile(quat.IDENTITY, (frames, 1, 1))
    rotations = np.concatenate([still, clip.rotations], axis=1)
    translations = np.concatenate([np.zeros((frames, 1, 3)), clip.translations], axis=1)
    return Clip(joints, rotations, translations, clip.rate)


def test_new_clips_are_turned_and_collapsed_as_the_family_was(family, tmp_path):
    own, examples, model = family
    wanted = [e for e in examples if e.row.file.name in ("stride_01.bvh", "stride_08.bvh")]
    for path in [e.row.file for e in wanted]:
        clip = ingest.clip_of_file(motion_readers.read(path), own.source)
        content = bvh_writer.dumps(below_a_dummy(clip), metres_per_unit=1.0)
        (tmp_path / path.name).write_bytes(content)
    paths = [tmp_path / e.row.file.name for e in wanted]
    reopened = model_reconstruction.load(model)
    found, _ = new_clips.examples_of_files(reopened, paths, own.source, WOLF)
    for one, other in zip(wanted, found, strict=True):
        assert other.facing == -90.0 and other.clip.skeleton.names == one.clip.skeleton.names
        assert np.abs(one.clip.positions() - other.clip.positions()).max() < 1e-5
        assert one.controls == pytest.approx(other.controls, abs=1e-3)
    making = replace(reopened.card.making, facing=0.0)
    plain, _ = new_clips.examples_of_files(
        replace(reopened, card=replace(reopened.card, making=making)), paths, own.source, WOLF
    )
    assert np.abs(plain[0].clip.positions() - wanted[0].clip.positions()).max() > 0.1
