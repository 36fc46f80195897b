"""Tests of the floor of a question: what its clips do on it, and where it is refused."""

from dataclasses import replace

import numpy as np
import pytest

from posefield.common.errors import FormError, InvalidField
from posefield.inference import session
from posefield.question import json_decoding, text_decoding
from posefield.question.floor import Floor, at_height
from posefield.question.motion_question import ClipQuestion
from posefield.synthesis import clips
from posefield.synthesis.synthesizer import Synthesizer

UPHILL = Floor(0.1, 0.05, 0.2)


@pytest.fixture(scope="module")
def walker(walk_path):
    return Synthesizer("stroll", session.load(walk_path))


def asked(model, **more):
    controls = {control.name: control.default for control in model.session.card.controls}
    return ClipQuestion(controls=controls, **more)


def made(model, **more):
    return clips.synthesize_clip(model, asked(model, **more))


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
        assert np.abs(path - stance.position).max(initial=0.0) < 2e-6
    assert told.left == () and told.drift < 1e-6
    # On a slope a clip is no loop: the low parts of the swings at its ends count as skate.
    assert told.skate < min(0.01, told.skate_before)
    heights, flat = (
        (feet[..., 1] - ground.heights(feet)).min()
        for feet, ground in (
            (feet_of(walker, placed), floor),
            (feet_of(walker, level), at_height(0.0)),
        )
    )
    # Feet are as high above this floor as above the level one, and those of that one are not.
    assert heights > flat - 0.01
    wrong = feet_of(walker, level)
    assert abs((wrong[..., 1] - floor.heights(wrong)).min() - flat) > 0.05


def test_a_floor_at_height_0_is_none(walker):
    usual, told = made(walker), made(walker, floor=at_height(0.0))
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
    assert made(plain, floor=0.2, feet="stand").trust.feet.floor == at_height(0.2)


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
