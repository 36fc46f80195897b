"""Tests of measured controls: their values come from the clips as trained."""

import tomllib
from dataclasses import replace

import numpy as np
import pytest
from families import sample_walk
from minimal import SKELETON, plain_recipe, recipe_with, small_clip, write_clips
from test_phase import cycle

import posefield_train
from posefield.model_file import checked_file, model_card
from posefield.motion import measures
from posefield.motion.measures import Measure, MeasuredMotion
from posefield_train.align import phase_alignment
from posefield_train.graph import onnx_export
from posefield_train.source import ingest, measured_controls
from posefield_train.source.recipe import Recipe

# Half of the last decimal that is kept.
KEPT = 0.5000001 * 10.0**-measured_controls.DECIMALS
# A file keeps a millionth of a degree and of a metre; a stride's way adds a few of them.
WRITTEN = 1e-5


def control(name, **auto):
    return {"name": name, "description": name, "auto": auto}


AUTO = [
    control("speed", quantity="speed"),
    control("turn", quantity="turn"),
    {**sample_walk.recipe().controls[0].model_dump(), "name": "typed"},
    control("stride", quantity="stride_length"),
    control("step", quantity="step_length"),
    control("lift", quantity="height", joint=["LeftFoot", "RightFoot"], at="highest"),
    control("hips", quantity="root_height", at="down"),
]


def auto_recipe(*controls, **sections):
    plain = tomllib.loads(sample_walk.RECIPE_TEXT)
    plain["controls"] = list(controls)
    for section, values in sections.items():
        plain[section] = {**plain.get(section, {}), **values}
    return Recipe.model_validate(plain)


@pytest.fixture(scope="module")
def strides(tmp_path_factory):
    """Folder of the stroll with a frame in the middle of each stride as a landmark, down."""
    folder = sample_walk.write_walk(tmp_path_factory.mktemp("strides"))
    first, *rows = (folder / "strides.csv").read_text().splitlines()
    rows = [f"{row},{20 + index % 3}" for index, row in enumerate(rows)]
    (folder / "strides.csv").write_text("\n".join([f"{first},down", *rows]) + "\n")
    return folder


@pytest.fixture(scope="module")
def own():
    return auto_recipe(*AUTO, clips={"landmarks": ["down"]})


@pytest.fixture(scope="module")
def examples(own, strides):
    return ingest.ingest(own, strides)[0]


def seen(example):
    clip = example.clip
    gone = measured_controls.travel(clip.rotations[:, 0], clip.root_path)
    at = example.landmarks[0] * (len(clip) - 1)
    parents = clip.skeleton.parents
    return MeasuredMotion(clip.positions(), clip.duration, gone, parents, example.offsets, at)


MEASURES = {
    "speed": Measure("speed"),
    "turn": Measure("turn"),
    "stride": Measure("stride_length"),
    "step": Measure("step_length", (3, 6)),
    "lift": Measure("height", (3, 6), "highest"),
    "hips": Measure("height", (0,), "landmark"),
}


def columns(own, examples):
    names = [control.name for control in own.controls]
    return dict(zip(names, np.transpose([e.controls for e in examples]), strict=True))


def test_controls_are_what_is_measured_of_the_clips_in_the_recipes_order(own, examples):
    found = columns(own, examples)
    for name, asked in MEASURES.items():
        expected = np.array([measures.evaluate(asked, seen(example)) for example in examples])
        assert np.abs(found[name] - expected).max() < KEPT, name
        assert np.ptp(expected) > 10 * KEPT, "negative control: it is not the same in all"


def test_measured_strides_are_those_that_were_made(own, examples):
    found, haste = columns(own, examples), columns(own, examples)["typed"] / 3.6
    veer = np.array([-0.5, -0.2, 0.2, 0.5] * 5)
    assert np.abs(found["turn"] - np.degrees(veer)).max() < 100 * WRITTEN
    chord = haste * np.sinc(veer / (2 * np.pi))
    assert np.abs(found["speed"] - chord).max() < WRITTEN
    assert np.abs(found["speed"] - haste).max() > 100 * WRITTEN, "negative control: arcs"


def test_a_clip_elsewhere_that_faces_another_way_measures_the_same(tmp_path):
    own = recipe_with()
    plain = plain_recipe()
    plain["controls"] = [
        control("left", quantity="left", joint="LeftHand", at="end"),
        control("ahead", quantity="forward", joint="LeftHand", at="farthest"),
        control("low", quantity="height", joint="LeftHand", at="lowest"),
    ]
    plain["motion"] = own.motion.model_dump()
    write_clips(tmp_path, [small_clip(heading=0.3), small_clip(heading=2.0), small_clip(1.0)])
    found = [e.controls for e in ingest.ingest(Recipe.model_validate(plain), tmp_path)[0]]
    assert np.abs(found[0] - found[1]).max() < WRITTEN
    assert np.abs(found[0] - found[2]).max() > 100 * WRITTEN, "negative control"


def test_a_leg_is_that_of_the_roles_where_no_joints_are_named(strides):
    roles = {"leftUpperLeg": "RightUpLeg", "leftFoot": "RightFoot"}
    own = auto_recipe(control("leg", quantity="leg_length"), roles=roles)
    joints = ingest.ingest(own, strides)[0][0].clip.skeleton
    assert measured_controls.control_measure(own, own.measured[0], joints) == Measure(
        "leg_length", (5, 6)
    )


def test_a_cycle_begun_elsewhere_is_measured_from_there():
    own = recipe_with(motion={"cyclic": True}, alignment={"begin": "in_phase"})
    plain = own.model_dump(by_alias=True, mode="json")
    plain["controls"] = [
        control("hand", quantity="height", joint="LeftHand", at="start"),
        control("turn", quantity="turn"),
    ]
    auto = Recipe.model_validate(plain)
    cuts = np.array([-12, 4, 8, -3, 3]) / 100
    family = [cycle(cut) for cut in cuts]
    family = [
        replace(e, controls=measured_controls.control_values(auto, e.row, e.clip, ()))
        for e in family
    ]
    begun = phase_alignment.align_phases(auto, tuple(family), np.ones(len(SKELETON)))
    for before, after in zip(family, begun, strict=True):
        again = measured_controls.control_values(auto, after.row, after.clip, after.landmarks)
        assert np.array_equal(after.controls, again)
        assert after.controls[1] == pytest.approx(before.controls[1], abs=1e-6)
    hands = np.array([[e.controls[0] for e in own] for own in (family, begun)])
    # In phase they begin alike; as they were cut they do not.
    assert np.ptp(hands[1]) < 0.02 < 0.1 < np.ptp(hands[0])


@pytest.fixture(scope="module")
def made(strides):
    own = auto_recipe(*AUTO[:2])
    trained = posefield_train.train(own, strides)
    return own, trained, onnx_export.export_model(trained).card


def test_a_models_examples_are_what_is_measured_of_its_clips(made):
    _, trained, own_card = made
    asked = [control.measure for control in own_card.controls]
    assert asked == [MEASURES["speed"], MEASURES["turn"]]
    assert [control.unit for control in own_card.controls] == ["m/s", "deg"]
    for example, kept in zip(trained.examples, own_card.examples, strict=True):
        clip = replace(example, landmarks=(0.0,))
        expected = [measures.evaluate(one, seen(clip)) for one in asked]
        assert np.abs(np.array(kept) - expected).max() < KEPT
    entries = {key: text.encode() for key, text in model_card.dump(own_card).items()}
    again = checked_file.decode_card(entries)
    assert [control.measure for control in again.controls] == asked
