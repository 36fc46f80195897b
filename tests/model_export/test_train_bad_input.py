"""Tests of training with unusual input: errors, or notes in the model."""

import re
from dataclasses import replace

import numpy as np
import pytest
from minimal import recipe_with, small_clip, write_clips

import posefield_train
from posefield.common.errors import RecipeError, TrainingError
from posefield.motion import quat
from posefield_train.graph import onnx_export, trained_card
from posefield_train.graph.trained_model import Outlier
from posefield_train.source import ingest, recipe
from posefield_train.source.canonical import Finding

EIGHT = tuple(small_clip(0.1 * i, 21 + i % 3) for i in range(8))


@pytest.fixture
def model(tmp_path):
    """Function that trains a model of clips and the table that lists them, and writes its file."""

    def of(motions, rows=None, head="file,v", **sections):
        write_clips(tmp_path, motions)
        if rows is not None:
            (tmp_path / "clips.csv").write_text("\n".join([head, *rows]) + "\n")
        own = recipe_with(**sections)
        trained = posefield_train.train(own, tmp_path)
        return trained, onnx_export.export_model(trained)

    return of


def notes(exported):
    return exported.card.diagnostics["notes"]


def speeds(*values):
    return [f"{index}.bvh,{value}" for index, value in enumerate(values)]


def test_a_plain_family_has_nothing_to_be_noted(model):
    trained, exported = model(EIGHT)
    assert notes(exported) == []
    assert trained.explained["pose"] > 0.9


def test_poses_of_all_files_together_are_bounded(tmp_path):
    """Each file is within its own bound, and each is a thousandth of what it unpacks to."""
    joints = "".join(f"JOINT j{index} {{ OFFSET 0 0 0 }}\n" for index in range(1, 1000))
    head = f"HIERARCHY\nROOT j0 {{ OFFSET 0 0 0 CHANNELS 1 Xrotation\n{joints}}}\n"
    text = f"{head}MOTION\nFrames: 10000\nFrame Time: 0.1\n" + "0\n" * 10_000
    rows = []
    for index in range(4):
        (tmp_path / f"{index}.bvh").write_text(text)
        rows.append(f"{index}.bvh,{index}")
    (tmp_path / "clips.csv").write_text("\n".join(["file,v", *rows]) + "\n")
    with pytest.raises(RecipeError) as refused:
        ingest.ingest(recipe_with(), tmp_path)
    place = tmp_path / "3.bvh"
    assert refused.value.line == 5
    assert refused.value.message == (
        f"found 40000000 poses of a joint in the files up to {place}, expected at most 30000000"
    )


def test_a_control_of_few_values_is_taken_and_they_are_listed(model):
    trained, exported = model(EIGHT, speeds(*(0, 1) * 4))
    assert exported.card.controls[0].values == (0.0, 1.0)
    assert np.isfinite(trained.left_out_errors).all()
    assert np.isfinite([*trained.pose.hyper.scales, trained.pose.hyper.nugget]).all()


def test_motions_that_are_all_the_same_are_refused(model):
    with pytest.raises(TrainingError) as refused:
        model([EIGHT[0]] * 8)
    assert str(refused.value) == (
        "all 8 clips have the same motion, expected motions that differ with their controls: check "
        "column 'file' of the table and its frames"
    )
    # Negative control: one clip that differs is enough.
    trained, exported = model([*[EIGHT[0]] * 7, EIGHT[5]])
    assert np.isfinite(trained.left_out_errors).all()
    (said,) = notes(exported)[-1:]
    assert said.startswith("line 3, 1.bvh shares frames with line 2, 0.bvh; 7 clips have such a")


def cause(model, rows, head="file,v", **sections):
    with pytest.raises(TrainingError) as refused:
        model(EIGHT, rows, head, **sections)
    start, end = "expected at least two values; ", "; leave it out of the recipe, or add clips"
    said = str(refused.value)
    assert said.startswith("control 'speed' has the value 2 in all ")
    return said[said.index(start) + len(start) : said.index(end)]


def test_a_control_of_one_value_is_refused_with_its_cause(model):
    assert cause(model, speeds(*[2] * 8)) == "column 'v' holds it in every row"
    rows = [f"{i}.bvh,{i // 4 * 2},{i // 4}" for i in range(8)]
    lets = {"clips": {"where": {"side": {"minimum": 1.0}}}}
    assert cause(model, rows, "file,v,side", **lets) == (
        "column 'v' holds it in every row that [clips.where] lets pass"
    )
    lets = {"clips": {"where": {"v": {"minimum": 1.0}}}}
    assert cause(model, rows, "file,v,side", **lets) == (
        "column 'v' holds it in every row that [clips.where] lets pass by this column"
    )


@pytest.mark.parametrize(
    ("auto", "said"),
    [
        (
            {"quantity": "forward", "joint": "Hips", "at": "start"},
            "each clip begins at the origin, so that a root is there in all of them",
        ),
        (
            {"quantity": "root_height", "at": "start"},
            "root_height at start is measured, and no clip differs in it",
        ),
    ],
)
def test_a_measured_control_of_one_value_is_refused_with_its_cause(tmp_path, auto, said):
    write_clips(tmp_path, EIGHT)
    plain = recipe_with().model_dump(by_alias=True, exclude_unset=True)
    plain["controls"] = [{"name": "found", "auto": auto, "description": "Measured"}]
    own = recipe.Recipe.model_validate(plain)
    with pytest.raises(TrainingError, match=r"'found' has the value .* in all 8") as refused:
        posefield_train.train(own, tmp_path)
    assert said in str(refused.value)


def test_equal_controls_with_quite_different_motion_are_noted(model):
    rng = np.random.default_rng(5)
    phases = rng.permutation(8) * 0.7
    clips = [small_clip(phase, 21 + i % 3) for i, phase in enumerate(phases)]
    _, exported = model(clips, speeds(0, 0, 1, 1, 2, 2, 3, 3))
    (said,) = [note for note in notes(exported) if "share their controls" in note]
    assert re.fullmatch(
        r"8 of 8 clips share their controls with others, such as line \d, \d\.bvh, and differ from "
        r"them by \d+\.\d cm where all clips differ by \d+\.\d cm: a control that tells them apart "
        r"may be missing",
        said,
    )
    # Negative control: pairs that resemble each other more than other clips are repeated trials.
    pairs = [small_clip(0.5 * (i // 2) + 0.05 * (i % 2), 21 + i % 3) for i in range(8)]
    _, exported = model(pairs, speeds(0, 0, 1, 1, 2, 2, 3, 3))
    assert [note for note in notes(exported) if "share their controls" in note] == []


def shake(count, phase):
    """A body that raises an arm, shakes it some times and lowers it."""
    clip, t = small_clip(0.0, 121), np.linspace(0.0, 1.0, 121)
    angles = (0.8 + 0.3 * np.sin(2.0 * np.pi * count * t + phase)) * np.sin(np.pi * t) ** 2
    rotations = np.tile([1.0, 0.0, 0.0, 0.0], (121, 5, 1))
    rotations[:, 3] = quat.from_axis_angle(np.array([0.0, 0.0, 1.0]), angles)
    return replace(clip, rotations=rotations)


def test_gestures_of_unlike_number_and_phase_that_average_out_are_noted(model):
    rng = np.random.default_rng(7)
    counts, phases = rng.permutation(np.linspace(8.0, 20.0, 12)), rng.uniform(0.0, 6.3, 12)
    _, exported = model(list(map(shake, counts, phases)), motion={"frames": 60})
    (said,) = [note for note in notes(exported) if "average out" in note]
    assert 30 < int(re.match(r"predictions of left-out clips have (\d+) % ", said)[1]) < 60
    # Negative control: all shake alike.
    _, exported = model([shake(14.0, 0.05 * i) for i in range(12)], motion={"frames": 60})
    assert [note for note in notes(exported) if "average out" in note] == []


def test_what_is_the_same_in_many_clips_is_one_note_and_the_worst_come_first(model):
    trained, _ = model(EIGHT)
    jumps = [Finding("jump", 4, clip, 1.6 + 0.1 * clip) for clip in range(6)]
    found = [*jumps, Finding("flip", 2, 1, 2.5), Finding("flip", 2, 3, 2.6)]
    shifted = tuple(replace(e, shift=0.1 + 0.01 * i) for i, e in enumerate(trained.examples))
    kinds = ("duration", "size", *["far"] * 7)
    against = tuple(Outlier(i % 8, kind, f"{kind} {i}") for i, kind in enumerate(kinds))
    noisy = replace(trained, findings=found, examples=shifted, outliers=against)
    own = trained_card.training_notes(replace(noisy, notes=("of the files",)))
    rows = [example.row.named for example in shifted]
    assert own == [
        f"{rows[1]}: size 1",
        f"{rows[0]}: far 8; duration 0",
        *(f"{rows[i]}: far {i}" for i in range(2, 6)),
        f"2 more clips with such evidence: {rows[6]}, {rows[7]}",
        "of the files",
        f"jumps between two frames taken out in 6 of 8 clips, the largest in {rows[5]}: LeftHand "
        "by 120 degrees",
        f"{rows[1]}: half turns taken out: Head by 143 degrees",
        f"{rows[3]}: half turns taken out: Head by 149 degrees",
        f"8 of 8 clips begin elsewhere in their cycle than they were cut, the most {rows[7]}: "
        "begun 17% of its cycle later than it was cut",
    ]
    few = replace(noisy, findings=jumps[:3], outliers=(), examples=trained.examples)
    assert len(trained_card.training_notes(few)) == 3
