"""Tests of reading new clips for a recipe, and of errors for invalid ones."""

from dataclasses import replace

import newcomers
import numpy as np
import pytest

import posefield_train
from posefield.common.errors import RecipeError
from posefield.motion.measures import Measure
from posefield_train.adapt import model_reconstruction, new_clips
from posefield_train.graph import onnx_export
from posefield_train.source import ingest
from posefield_train.source.recipe_sections import Source

CY = {"performer": "cy"}
METRES = Source(metres_per_unit=1.0, up="y")


@pytest.fixture(scope="module")
def reopened(tmp_path_factory):
    folder = newcomers.write(tmp_path_factory.mktemp("family") / "small")
    recipe = newcomers.recipe()
    trained = posefield_train.train(recipe, folder)
    return model_reconstruction.reconstruct(onnx_export.export_model(trained).content, "small.onnx")


@pytest.fixture
def table(tmp_path):
    return newcomers.write_newcomer(tmp_path / "cy", (2.0, 7.0))


def with_measure(reopened, measure):
    card = reopened.card
    return replace(
        reopened, card=replace(card, controls=(replace(card.controls[0], measure=measure),))
    )


def test_a_tables_clips_are_those_that_training_would_have_seen(reopened, table):
    found, notes = new_clips.examples_of_table(reopened, table, METRES, CY)
    assert notes == [] and [e.controls.tolist() for e in found] == [[2.0], [7.0]]
    (table.parent / "clips.csv").write_text("file,v,who\n0.bvh,2,cy\n1.bvh,7,cy\n")
    expected, _ = ingest.ingest(newcomers.recipe(), table.parent)
    for own, true in zip(found, expected, strict=True):
        assert np.array_equal(own.clip.rotations, true.clip.rotations)
        assert np.array_equal(own.clip.translations, true.clip.translations)
        assert own.row.performer == "cy"


def test_frames_and_units_are_followed(reopened, table):
    table.write_text("file,speed,first_frame,last_frame\n0.bvh,2,3,20\n")
    (cut,), _ = new_clips.examples_of_table(reopened, table, METRES, CY)
    assert len(cut.clip) == 18 and cut.row.source == "0.bvh, frames 3 to 20"
    centimetres = Source(metres_per_unit=0.01, up="y")
    (small,), _ = new_clips.examples_of_table(reopened, table, centimetres, CY)
    assert small.offsets == pytest.approx(0.01 * cut.offsets)


def test_what_can_be_measured_is_measured(reopened, table):
    hand = reopened.card.skeleton.names.index("LeftHand")
    own = with_measure(reopened, Measure("height", (hand,), "end"))
    paths = [table.parent / "0.bvh", table.parent / "1.bvh"]
    found, _ = new_clips.examples_of_files(own, paths, METRES, CY)
    for example in found:
        assert example.controls[0] == pytest.approx(example.clip.positions()[-1, hand, 1], abs=1e-6)
    # Negative control: another moment has another value.
    other = with_measure(reopened, Measure("height", (hand,), "start"))
    assert new_clips.examples_of_files(other, paths, METRES, CY)[0][0].controls != found[0].controls
    # What a table says counts.
    said, _ = new_clips.examples_of_table(own, table, METRES, CY)
    assert [e.controls[0] for e in said] == [2.0, 7.0]


def test_what_was_measured_is_measured_again_where_a_clip_begins_elsewhere(reopened, table):
    hand = reopened.card.skeleton.names.index("LeftHand")
    own = with_measure(reopened, Measure("height", (hand,), "start"))
    (example,), _ = new_clips.examples_of_files(own, [table.parent / "0.bvh"], METRES, CY)
    clip = example.clip
    later = replace(clip, rotations=clip.rotations[9:], translations=clip.translations[9:])
    (again,) = new_clips.remeasure(own, [example], [replace(example, clip=later)])
    assert again.controls[0] == pytest.approx(clip.positions()[9, hand, 1], abs=1e-6)
    assert again.controls[0] != example.controls[0]
    # What somebody said stays, and so does what cannot be measured.
    said = replace(example, controls=np.array([2.0]))
    for model in (own, reopened):
        (kept,) = new_clips.remeasure(model, [said], [replace(said, clip=later)])
        assert kept.controls.tolist() == [2.0]


def test_a_control_that_nobody_can_measure_is_asked_for(reopened, table):
    with pytest.raises(RecipeError, match="nothing says 'speed', which cannot be measured"):
        new_clips.examples_of_files(reopened, [table.parent / "0.bvh"], METRES, CY)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("file\n0.bvh\n", "no column 'speed'"),
        ("file,speed\n9.bvh,1\n", "cy.csv:2: column 'file'"),
        ("file,speed,haste\n0.bvh,1,2\n", r"columns \['haste'\], expected some of"),
        ("file,speed,last_frame\n0.bvh,1,0\n", "frames 0 to 0, expected at least two"),
    ],
)
def test_tables_that_cannot_be_meant(reopened, table, text, said):
    table.write_text(text)
    with pytest.raises(RecipeError, match=said):
        new_clips.examples_of_table(reopened, table, METRES, CY)


def test_the_same_file_twice_is_refused(reopened, table):
    own = with_measure(reopened, Measure("height", (0,), "end"))
    with pytest.raises(RecipeError, match="same frames of the same file as before"):
        new_clips.examples_of_files(own, [table.parent / "0.bvh"] * 2, METRES, CY)


def exchanged(text):
    return text.replace("Head", "?").replace("LeftArm", "Head").replace("?", "LeftArm")


def rewritten(table, change):
    """The first clip's file with its text changed."""
    path = table.parent / "0.bvh"
    path.write_text(change(path.read_text()))


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda text: text.replace("LeftHand", "LeftFist"), r"0\.bvh has no joints \['LeftHand'\]"),
        (exchanged, "with other parents"),
    ],
)
def test_a_clip_of_another_skeleton_is_refused(reopened, table, change, said):
    rewritten(table, change)
    with pytest.raises(RecipeError, match=said):
        new_clips.examples_of_table(reopened, table, METRES, CY)


def test_joints_that_the_model_does_not_have_are_left_out_and_said(reopened, table):
    tail = (
        "JOINT Tail\n{\nOFFSET 0 0 -0.1\nCHANNELS 3 Zrotation Xrotation Yrotation\n"
        "End Site\n{\nOFFSET 0 0 -0.1\n}\n}\n"
    )

    def grown(text):
        head, motion = text.split("MOTION")
        cut = head.rstrip().rindex("}")
        lines = motion.strip().splitlines()
        longer = [*lines[:2], *(f"{line} 1 2 3" for line in lines[2:])]
        return head[:cut] + tail + head[cut:] + "MOTION\n" + "\n".join(longer) + "\n"

    plain, _ = new_clips.examples_of_table(reopened, table, METRES, CY)
    rewritten(table, grown)
    found, notes = new_clips.examples_of_table(reopened, table, METRES, CY)
    assert notes == [
        f"{table.parent / '0.bvh'}: joints ['Tail'], which the model does not have, were left out"
    ]
    assert np.abs(found[0].clip.rotations - plain[0].clip.rotations).max() < 1e-12
