"""Tests of outlier detection: outliers are named with evidence, other clips are not."""

from dataclasses import replace

import numpy as np
import pytest

from posefield.motion import quat
from posefield_train import training
from posefield_train.graph import onnx_export
from posefield_train.source import recording_groups
from posefield_train.source.canonical import place

# A clip from the middle of the family, and one of another performer far from it.
PLANTED, OTHER = 15, 40
ACROSS = np.array([-1.0, 1.0, 1.0])
MIRROR = np.array([1.0, 1.0, -1.0, -1.0])


def mirrored(clip):
    """The same with left for right: what the left hand did the right one does."""
    return exchanged(reversed_axis(clip))


def reversed_axis(clip):
    return replace(clip, rotations=clip.rotations * MIRROR, translations=clip.translations * ACROSS)


def exchanged(clip):
    other = list(recording_groups.mirrored_joints(clip.skeleton.names))
    return replace(
        clip, rotations=clip.rotations[:, other], translations=clip.translations[:, other]
    )


def lying(clip):
    """A file with Z up that was read as if Y were."""
    turn = np.broadcast_to(
        quat.from_axis_angle(np.array([1.0, 0.0, 0.0]), np.array(np.pi / 2)), (len(clip), 4)
    )
    rotations, translations = clip.rotations.copy(), clip.translations.copy()
    rotations[:, 0] = quat.mul(turn, rotations[:, 0])
    translations[:, 0] = quat.rotate(turn, translations[:, 0])
    fallen = replace(clip, rotations=rotations, translations=translations)
    return place(fallen, fallen.root_path[0] * [1.0, 0.0, 1.0], np.array(0.0))


def in_centimetres(clip):
    return replace(clip, translations=100.0 * clip.translations)


def leaping(clip):
    translations = clip.translations.copy()
    translations[60:, 0, 0] += 0.2
    return replace(clip, translations=translations)


def slow(clip):
    return replace(clip, rate=clip.rate / 2.5)


def kicking(clip):
    """Another action."""
    bell = np.exp(-0.5 * ((np.linspace(0.0, 1.0, len(clip)) - 0.5) / 0.15) ** 2)
    joint = clip.skeleton.names.index("RightUpLeg")
    rotations = clip.rotations.copy()
    kick = quat.from_axis_angle(np.array([1.0, 0.0, 0.0]), -1.8 * bell)
    rotations[:, joint] = quat.mul(rotations[:, joint], kick)
    return replace(clip, rotations=rotations)


PLANTS = {
    mirrored: ({"far", "disguise"}, ["from what the others predict", "mirrored left to right its"]),
    reversed_axis: ({"far", "disguise", "bones"}, ["the axis from left to right reversed its"]),
    exchanged: ({"far", "disguise", "bones"}, ["names of left and right joints exchanged its"]),
    lying: ({"far", "disguise"}, ["with z for up its joints would lie"]),
    in_centimetres: ({"far", "size"}, ["is the file in centimetres, not in units of 1 m?"]),
    leaping: ({"far", "leap"}, ["its whole body leaps 20 cm between frames 59 and 60, "]),
    slow: ({"duration"}, ["lasts ", "s, expected about "]),
    kicking: ({"far"}, [" times as far as is usual", "; most like it is line "]),
}


@pytest.fixture(scope="module")
def quick_recipe(small_recipe):
    """The small recipe with one kriging model to fit instead of four to choose from."""
    plain = {"covariance": "matern52", "drift": 1}
    return small_recipe.model_copy(
        update={"kriging": small_recipe.kriging.model_copy(update=plain)}
    )


def planted(recipe, examples, clip):
    own = list(examples)
    own[PLANTED] = replace(own[PLANTED], clip=clip)
    return training.train_examples(recipe, own)


def only_note(trained, example):
    # A clip a hundred times too large may spoil the prediction of another, but comes first.
    note, *others = trained.outlier_notes()
    assert len(others) <= 1
    name = f"line {example.row.line}, {example.row.file.name}: "
    assert note.startswith(name)
    return note.removeprefix(name)


# Each takes a training: these three differ most, and the system ring has the others.
QUICK = (mirrored, in_centimetres, kicking)


@pytest.mark.parametrize(
    "plant",
    [
        pytest.param(each, id=each.__name__, marks=[pytest.mark.system] * (each not in QUICK))
        for each in PLANTS
    ],
)
def test_a_stranger_is_named_with_the_right_evidence(quick_recipe, examples, plant):
    kinds, said = PLANTS[plant]
    trained = planted(quick_recipe, examples, plant(examples[PLANTED].clip))
    note = only_note(trained, examples[PLANTED])
    assert {one.kind for one in trained.outliers} == kinds
    for part in said:
        assert part in note


def test_a_clip_of_another_performer_is_named_with_whose_it_is(quick_recipe, examples):
    own, other = examples[PLANTED], examples[OTHER]
    assert own.row.performer != other.row.performer
    trained = planted(quick_recipe, examples, other.clip)
    note = only_note(trained, own)
    assert f"from those of {own.row.performer} elsewhere (" in note
    assert f"and by 0.0 cm from those of {other.row.performer}" in note
    card = onnx_export.export_model(replace(trained, notes=("said before",))).card
    assert card.diagnostics["notes"][:2] == [*trained.outlier_notes(), "said before"]


def test_a_clean_family_has_no_strangers(trained):
    assert trained.outliers == ()
    assert trained.outlier_notes() == []


def test_two_strangers_are_told_apart_from_those_whom_they_mislead(quick_recipe, examples):
    own = list(examples)
    for index, plant in ((PLANTED, kicking), (PLANTED + 2, mirrored)):
        own[index] = replace(own[index], clip=plant(own[index].clip))
    notes = training.train_examples(quick_recipe, own).outlier_notes()
    lines = {f"line {examples[i].row.line}" for i in (PLANTED, PLANTED + 2)}
    assert {note.partition(",")[0] for note in notes} == lines
