"""Tests of recipes whose clips become one topology: files, notes, predictions and refusals."""

import numpy as np
import pytest
from expressed_skeletons import arms_first, random_turns, renamed, with_joint, with_rest

import posefield_train
from posefield.common.errors import RecipeError
from posefield.motion import bvh_writer
from posefield_train.graph import onnx_export
from posefield_train.sample import sample_files
from posefield_train.source import ingest, recipe

TEXT = """\
schema = 1
name = "reach"
description = "Reaching"
licence = "CC0-1.0"
[source]
metres_per_unit = 1.0
up = "y"
[clips]
table = "clips.csv"
file = "file"
performer = "who"
SKELETON
[[controls]]
name = "height"
auto = { quantity = "height", joint = "HAND", at = "end" }
description = "Height of the right hand at the end"
[motion]
frames = 20
cyclic = false
root = "travelling"
[size]
ranks = [8, 8, 8]
levels = []
"""
UNIFIED = '[skeleton]\ntopology = "roles"'
JOINTS = {"HAND": "rightHand", "SKELETON": UNIFIED}
FILES = {"HAND": "RightHand", "SKELETON": ""}


@pytest.fixture(scope="module")
def trials():
    """Twelve clips of one performer, spread over the samples."""
    found = list(sample_files.samples())
    who = found[0].performer
    own = [trial.clip for trial in found if trial.performer == who]
    return own[::2][:12]


def write(folder, clips, words, text=TEXT):
    """A folder of clips with its recipe."""
    folder.mkdir()
    for at, clip in enumerate(clips):
        content = bvh_writer.dumps(clip, metres_per_unit=1.0)
        (folder / f"{at:02d}.bvh").write_bytes(content)
    rows = "".join(f"{at:02d}.bvh,ann\n" for at in range(len(clips)))
    (folder / "clips.csv").write_text("file,who\n" + rows)
    for name, value in words.items():
        text = text.replace(name, value)
    (folder / "recipe.toml").write_text(text)
    return recipe.read(folder / "recipe.toml")


def expressed(clips, some=slice(None)):
    """The clips, some of them of a skeleton with other frames, order, names and joints."""
    turns = random_turns(len(clips[0].skeleton), seed=1)
    found = list(clips)
    for at in range(len(clips))[some]:
        own = with_joint(arms_first(with_rest(clips[at], turns)), "LHipJoint", "LeftUpLeg")
        found[at] = renamed(own, {"LeftFoot": "LeftAnkle", "RightFoot": "RightAnkle"})
    return found


def predictions(own, folder):
    """Values of the training's tensor in the order of the clips, and left-out errors, m."""
    trained = posefield_train.train(own, folder)
    errors = {
        example.row.file.name: np.sqrt(error)
        for example, error in zip(trained.examples, trained.left_out_errors, strict=True)
    }
    return trained, trained.notes, np.array([errors[name] for name in sorted(errors)])


def test_another_rest_pose_order_and_names_give_the_same_predictions(trials, tmp_path):
    plain = write(tmp_path / "a", trials, JOINTS)
    other = write(tmp_path / "b", expressed(trials), JOINTS)
    trained, notes, wanted = predictions(plain, tmp_path / "a")
    _, _, found = predictions(other, tmp_path / "b")
    assert wanted.mean() > 0.005
    assert found == pytest.approx(wanted, rel=1e-3)
    assert any("33 joints became 23 by their roles" in note for note in notes)
    exported = onnx_export.export_model(trained)
    assert exported.card.roles["rightHand"] == "rightHand"
    assert exported.card.roles["upperChest"] == "spine3"
    assert "LeftThumb1" not in exported.card.skeleton.names


def test_without_the_key_mixed_files_are_refused_or_worse(trials, tmp_path):
    own = write(tmp_path / "a", expressed(trials, slice(0, None, 2)), FILES)
    with pytest.raises(RecipeError, match="has other joints than"):
        ingest.ingest(own, tmp_path / "a")
    turns = random_turns(len(trials[0].skeleton), seed=1)
    rests = [with_rest(clip, turns) if at % 2 else clip for at, clip in enumerate(trials)]
    own = write(tmp_path / "b", rests, FILES)
    with pytest.raises(RecipeError, match="two performers under the name 'ann'"):
        ingest.ingest(own, tmp_path / "b")


def test_a_file_without_a_role_is_named_with_its_line(trials, tmp_path):
    odd = renamed(trials[1], {"Head": "Top"})
    own = write(tmp_path / "a", [trials[0], odd], JOINTS)
    with pytest.raises(RecipeError) as caught:
        ingest.ingest(own, tmp_path / "a")
    assert "01.bvh: skeleton.topology: found no joint for head, expected" in str(caught.value)
    assert ":3: " in str(caught.value) or "line 3" in str(caught.value)
    roles = UNIFIED + '\nroles = { head = ["Head", "Top"] }'
    own = write(tmp_path / "b", [trials[0], odd], JOINTS | {"SKELETON": roles})
    examples, _ = ingest.ingest(own, tmp_path / "b")
    assert "head" in examples[1].clip.skeleton.names


def test_the_recipe_names_joints_by_their_roles(trials, tmp_path):
    own = write(tmp_path / "a", trials[:2], JOINTS | {"HAND": "RightHand"})
    with pytest.raises(RecipeError, match="'RightHand' \\(did you mean 'rightHand'"):
        ingest.ingest(own, tmp_path / "a")
    text = TEXT.replace('"height", joint = "HAND", at = "end"', '"leg_length"')
    own = write(tmp_path / "b", trials[:2], JOINTS, text)
    examples, _ = ingest.ingest(own, tmp_path / "b")
    assert 0.5 < examples[0].controls[0] < 1.2


@pytest.mark.parametrize(
    ("added", "said"),
    [
        ('[roles]\nhead = "head"', "found roles and skeleton.topology = 'roles', whose joints"),
        ('[skeleton.roles]\nbeak = "head"', "beak"),
    ],
)
def test_roles_that_say_nothing_are_refused(tmp_path, added, said):
    text = TEXT.replace("[size]", f"{added}\n[size]")
    with pytest.raises(RecipeError, match=said):
        write(tmp_path / "a", [], JOINTS, text)
    words = FILES | {"SKELETON": '[skeleton]\nroles = { head = "Head" }'}
    with pytest.raises(RecipeError, match=r"found roles and skeleton\.topology = 'files'"):
        write(tmp_path / "b", [], words)
