"""Tests of clips whose feet stand: anchors, exact targets, loops, and the facts in `trust`."""

from dataclasses import replace

import numpy as np
import pytest
from changed_cards import measured_reach, with_card
from msgspec import structs

from posefield.common.errors import FormError, InvalidField
from posefield.common.units import UP
from posefield.feet import stance_rows
from posefield.inference import session
from posefield.question import json_decoding, text_decoding
from posefield.question.motion_question import ClipQuestion, Floor, Target
from posefield.synthesis import clips
from posefield.synthesis.synthesizer import Synthesizer


@pytest.fixture(scope="module")
def walker(walk_path):
    return Synthesizer("stroll", session.load(walk_path))


@pytest.fixture(scope="module")
def reach(labelled_path):
    """A reach model with feet, without contacts, whose hand height can be constrained."""
    return measured_reach(Synthesizer("reach", session.load(labelled_path)), feet="Foot")


def middle(model):
    return {control.name: control.default for control in model.session.card.controls}


def made(model, **asked):
    return clips.synthesize_clip(model, ClipQuestion(controls=middle(model), **asked))


def joint(model, answer, name):
    return answer.clip.positions()[:, model.session.card.skeleton.names.index(name)]


def test_a_standing_foot_keeps_its_place_at_any_rate(walker):
    for fps in (30.0, 47.0, 240.0):
        answer = made(walker, fps=fps, feet="stand")
        told = answer.trust.feet
        assert len(told.stances) >= 2 and told.left == ()
        times = np.arange(len(answer.clip)) / fps
        for stance in told.stances:
            inside = (times >= stance.begin + 1e-6) & (times <= stance.end - 1e-6)
            path = joint(walker, answer, stance.joint)[inside]
            assert_stands(path, stance)
        assert told.drift < 1e-9 and told.skate < 0.5 * told.skate_before


def assert_stands(path, stance):
    """A foot keeps its place over the floor; its height follows the prediction a little."""
    apart = np.abs(path - stance.position)
    assert apart[:, ::2].max(initial=0.0) < 2e-6
    assert apart[:, 1].max(initial=0.0) < 2.0 * stance_rows.UNEVEN


def test_bones_keep_their_lengths_and_other_joints_their_rotations(walker):
    free, placed = made(walker, feet="as_predicted"), made(walker, feet="stand")
    names = walker.session.card.skeleton.names
    assert (placed.clip.translations[:, 1:] == free.clip.translations[:, 1:]).all()
    assert (placed.clip.rotations[:, 0] == free.clip.rotations[:, 0]).all()
    level = np.abs(placed.clip.root_path - free.clip.root_path) @ (1.0 - UP)
    assert level.max() < 1e-12
    turned = np.abs(placed.clip.rotations - free.clip.rotations).max(axis=(0, 2))
    assert {names[j] for j in np.flatnonzero(turned)} <= {
        side + part for side in ("Left", "Right") for part in ("UpLeg", "Leg", "Foot", "ToeBase")
    }


def test_feet_as_predicted_have_the_bytes_of_a_model_without_contacts(walker):
    plain = with_card(walker, contacts=())
    ours, theirs = made(walker, feet="as_predicted"), made(plain)
    assert ours.clip.rotations.tobytes() == theirs.clip.rotations.tobytes()
    assert ours.clip.root_path.tobytes() == theirs.clip.root_path.tobytes()
    assert ours.trust == theirs.trust and ours.trust.feet is None


@pytest.mark.parametrize("root", ["travelling", "in_place"])
def test_a_loop_closes(walker, root):
    answer = made(walker, feet="stand", loop=True, root=root, fps=60.0)
    rotations, heights = answer.clip.rotations, answer.clip.root_path @ UP
    assert np.array_equal(rotations[-1, 1:], rotations[0, 1:])
    assert heights[-1] == heights[0]
    # It goes on over its seam as elsewhere.
    steps = np.abs(np.diff(np.concatenate([rotations, rotations[1:3]])[:, 1:], n=2, axis=0))
    seam = len(rotations) - 2
    assert steps[seam].max() < 1.5 * np.delete(steps, seam, axis=0).max()


def test_exact_targets_and_controls_stay_met(reach):
    free = made(reach, exact="none")
    # The last frame is the end.
    fps = 20.0 / free.trust.duration
    free = made(reach, exact="none", fps=fps)
    goal = np.add(joint(reach, free, "RightHand")[-1], [0.02, -0.01, 0.02])
    target = Target("RightHand", tuple(goal), at="end")
    placed = made(reach, exact="none", targets=(target,), fps=fps, feet="stand")
    assert np.abs(joint(reach, placed, "RightHand")[-1] - goal).max() < 1e-4
    assert placed.trust.targets[0].reached and placed.trust.feet.stances
    held = made(reach, fps=fps, feet="stand")
    wanted = middle(reach)["target_height"]
    assert joint(reach, held, "RightHand")[-1, 1] == pytest.approx(wanted, abs=1e-3)
    assert held.trust.measured["target_height"] == pytest.approx(wanted, abs=1e-3)


def test_a_foot_with_a_target_is_as_predicted_and_told(reach):
    fps = 20.0 / made(reach, exact="none").trust.duration
    free = made(reach, exact="none", fps=fps)
    goal = np.add(joint(reach, free, "LeftFoot")[-1], [0.05, 0.0, 0.05])
    asked = {"exact": "none", "targets": (Target("LeftFoot", tuple(goal), at="end"),), "fps": fps}
    placed, plain = made(reach, feet="stand", **asked), made(reach, **asked)
    assert np.abs(joint(reach, placed, "LeftFoot") - joint(reach, plain, "LeftFoot")).max() < 1e-6
    (target,), (left,) = placed.trust.targets, plain.trust.targets
    assert target.miss == pytest.approx(left.miss, abs=1e-6)
    assert placed.trust.feet.left == ("LeftFoot is as predicted: its leg meets an exact target",)
    assert {stance.joint for stance in placed.trust.feet.stances} == {"RightFoot"}


def test_feet_that_cannot_stand_are_refused(reach, walker):
    for model, said in (
        (with_card(reach, feet=()), "names no feet"),
        (with_card(walker, root="in_place"), "stays in place"),
    ):
        question = ClipQuestion(controls=middle(model), feet="stand")
        for ask in (clips.synthesize_clip, clips.check, clips.preview_clip):
            with pytest.raises(InvalidField, match=said) as fault:
                ask(model, question)
            assert fault.value.field == "feet"
        usual = clips.synthesize_clip(model, structs.replace(question, feet=None))
        assert usual.trust.feet is None


UPHILL = Floor(0.1, 0.05, 0.2)


def asked(model, **more):
    controls = {control.name: control.default for control in model.session.card.controls}
    return ClipQuestion(controls=controls, **more)


def feet_of(model, answer):
    return answer.clip.positions()[:, list(model.session.card.feet)]


def test_a_height_moves_everything_and_the_answer_tells_it(walker):
    usual, raised = made(walker, exact="none"), made(walker, exact="none", floor=0.25)
    moved = raised.clip.positions() - usual.clip.positions()
    assert np.abs(moved - [0.0, 0.25, 0.0]).max() < 1e-9
    told = raised.trust.facts()["feet"]
    assert told.pop("floor") == {"height": 0.25, "slope_x": 0.0, "slope_z": 0.0}
    plain = usual.trust.facts()["feet"]
    assert told.keys() == plain.keys() and told["swings"] == plain["swings"]
    for ours, theirs in zip(told["stances"], plain["stances"], strict=True):
        assert ours["position"][1] == pytest.approx(theirs["position"][1] + 0.25, abs=2e-6)


@pytest.mark.parametrize("floor", [UPHILL, Floor(0.0, 0.0, -0.3), Floor(-0.2, 0.3, 0.0)])
def test_feet_stand_on_a_slope(walker, floor):
    level, placed = made(walker, fps=60.0), made(walker, fps=60.0, floor=floor)
    told = placed.trust.feet
    names = walker.session.card.skeleton.names
    times = np.arange(len(placed.clip)) / 60.0
    positions = placed.clip.positions()
    for stance in told.stances:
        inside = (times >= stance.begin + 1e-6) & (times <= stance.end - 1e-6)
        path = positions[inside, names.index(stance.joint)]
        assert_stands(path, stance)
    assert told.left == () and told.drift < 1e-6
    # On a slope a clip is no loop: the low parts of the swings at its ends count as skate.
    assert told.skate < min(0.01, told.skate_before)
    feet, flat = feet_of(walker, placed), feet_of(walker, level)[..., 1].min()
    # Feet are as high above this floor as above the level one, and those of that one are not.
    plane = floor.height + feet @ [floor.slope_x, 0.0, floor.slope_z]
    assert (feet[..., 1] - plane).min() > flat - 0.01
    wrong = feet_of(walker, level)
    assert abs((wrong[..., 1] - floor.heights(wrong)).min() - flat) > 0.05


def test_a_floor_at_height_0_is_none(walker):
    usual, told = made(walker), made(walker, floor=Floor(0.0, 0.0, 0.0))
    assert usual.clip.rotations.tobytes() == told.clip.rotations.tobytes()
    assert usual.trust == told.trust and "floor" not in usual.trust.facts()["feet"]
    assert made(walker, floor=0.0, feet="as_predicted").trust.feet is None


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ({"floor": 0.2, "feet": "as_predicted"}, "expected feet that stand"),
        ({"floor": 11.0}, "11 m, expected -10 to 10 m"),
        ({"floor": Floor(0.0, float("inf"), 0.0)}, "expected a finite number"),
        ({"floor": Floor(0.0, 0.25, 0.25)}, "rises by 0.353553 m .* expected at most 0.3"),
        ({"floor": UPHILL, "loop": True}, "expected a level floor"),
    ],
)
def test_floors_that_are_refused(walker, more, said):
    question = asked(walker, **more)
    for check in (clips.synthesize_clip, clips.preview_clip, clips.check):
        with pytest.raises(InvalidField, match=said):
            check(walker, question)


def test_models_without_standing_feet_refuse_a_floor(walker):
    card = replace(walker.session.card, contacts=())
    plain = Synthesizer("plain", replace(walker.session, card=card))
    with pytest.raises(InvalidField, match="unless feet=stand is asked for"):
        made(plain, floor=0.2)
    assert made(plain, floor=0.2, feet="stand").trust.feet.floor == Floor(0.2, 0.0, 0.0)


@pytest.mark.parametrize(
    ("text", "floor"), [("0.2", 0.2), ("-1e-1", -0.1), ("0.1,0,-0.2", Floor(0.1, 0.0, -0.2))]
)
def test_floors_as_text(text, floor):
    found = text_decoding.decode_question(ClipQuestion, [("floor", text)])
    assert found.floor == floor and isinstance(found.ground, Floor)


@pytest.mark.parametrize("text", ["", "high", "1,2", "1,2,3,4", "0,nan,0", "0, 1, 0"])
def test_texts_that_are_no_floor(text):
    with pytest.raises(FormError, match="expected a height or height,slope_x,slope_z"):
        text_decoding.parse_value(text_decoding.parameters(ClipQuestion)["floor"], text)


def test_floors_in_json():
    def read(floor):
        content = f'{{"controls": {{}}, "floor": {floor}}}'.encode()
        return json_decoding.decode_question(ClipQuestion, content).floor

    assert read("1") == 1.0
    assert read('{"height": 1, "slope_x": 0, "slope_z": 0.1}') == Floor(1.0, 0.0, 0.1)
    for wrong in ('"0.2"', "[0, 0, 0]", '{"height": 1}', "null"):
        with pytest.raises(FormError, match="floor"):
            read(wrong)
