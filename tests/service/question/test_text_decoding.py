"""Tests of targets and exact controls as text and as plain values."""

import msgspec
import pytest

from posefield.common.errors import FormError, InvalidField
from posefield.question import text_decoding
from posefield.question.model_question import SigmaQuestion
from posefield.question.motion_question import FileQuestion, PoseQuestion, Target
from posefield.question.walk_question import WalkQuestion


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("rhand@end:0.3,1.2,-0.4", Target("rhand", (0.3, 1.2, -0.4), at="end")),
        ("rhand@0.8:1,2,3", Target("rhand", (1, 2, 3), time=0.8)),
        ("a@b@event:0,0,0", Target("a@b", (0, 0, 0), at="event")),
        ("左手@-1:0,0,0", Target("左手", (0, 0, 0), time=-1.0)),
    ],
)
def test_words_are_targets(text, expected):
    assert text_decoding.parse_target(text) == expected
    assert text_decoding.parse_target("=".join(text.rsplit(":", 1))) == expected


@pytest.mark.parametrize(
    "text",
    ["", "rhand@soon:0,0,0", "rhand@end:0,0", "rhand@end:0,0,1e999", "rhand@end:0,0, 1"],
)
def test_other_words_are_none(text):
    with pytest.raises(ValueError, match="expected JOINT@MOMENT:X,Y,Z, m; a moment is seconds or"):
        text_decoding.parse_target(text)


HAND = {"joint": "hand", "position": [0, 1.5, 2], "time": 1}


@pytest.mark.parametrize(
    "found",
    [
        {**HAND, "position": [0, 1]},
        {**HAND, "at": "end"},
        {"joint": "hand", "position": [0, 1, 2], "at": "soon"},
    ],
)
def test_plain_values_are_targets_or_none(found):
    assert msgspec.convert(HAND, Target) == Target("hand", (0.0, 1.5, 2.0), time=1)
    with pytest.raises(msgspec.ValidationError):
        msgspec.convert(found, Target)


def test_exact_controls_in_words():
    assert text_decoding.parse_exact("auto") == "auto"
    assert text_decoding.parse_exact("none") == "none"
    assert text_decoding.parse_exact("speed") == ("speed",)
    assert text_decoding.parse_exact("speed,turn") == ("speed", "turn")
    for text in ("", ",", "speed,"):
        with pytest.raises(ValueError, match="expected auto, none or names"):
            text_decoding.parse_exact(text)


def test_a_whole_number_may_be_written_as_any_number_of_a_body():
    assert [text_decoding.parse_integer(text) for text in ("2", "2.0", "2e0")] == [2, 2, 2]


def test_a_name_that_is_no_parameter_is_a_control():
    pairs = [("turn", "3"), ("fps", "24"), ("loop", "true"), ("unit", "cm")]
    pairs += [("target", "a@end:1,2,3"), ("target", "b@0.5:1,2,3")]
    found = text_decoding.decode_question(FileQuestion, pairs)
    targets = (Target("a", (1, 2, 3), at="end"), Target("b", (1, 2, 3), time=0.5))
    assert found == FileQuestion(
        controls={"turn": 3}, fps=24, loop=True, unit="cm", targets=targets
    )
    assert (
        found.has_constraints
        and not text_decoding.decode_question(FileQuestion, [("turn", "3")]).has_constraints
    )


@pytest.mark.parametrize(
    ("form", "pairs", "said"),
    [
        (PoseQuestion, [], "time: missing, expected time from the start"),
        (PoseQuestion, [("time", "0"), ("turn", "1"), ("turn", "2")], "turn: given twice"),
        (PoseQuestion, [("time", "nan")], "time: 'nan', expected a finite number"),
        (PoseQuestion, [("time", "0"), ("turn", "1_0")], "turn: '1_0', expected a finite number"),
        (PoseQuestion, [("time", "0"), ("level", "1.5")], "level: '1.5', expected a whole number"),
        (FileQuestion, [("up", "x")], "up: 'x', expected one of y, z"),
        (FileQuestion, [("loop", "1")], "loop: '1', expected one of true, false"),
        (WalkQuestion, [("camera", "1,2")], "camera: '1,2', expected x,y,z in metres"),
    ],
)
def test_words_that_are_no_question_are_named(form, pairs, said):
    with pytest.raises(FormError, match=said):
        text_decoding.decode_question(form, pairs)


@pytest.mark.parametrize(
    ("form", "pairs", "field"),
    [
        (SigmaQuestion, [("across", "a"), ("along", "a")], "along"),
        (SigmaQuestion, [("across", "a"), ("along", "b"), ("rows", "1")], "rows"),
        (WalkQuestion, [("fov", "1")], "fov"),
    ],
)
def test_a_question_checks_itself(form, pairs, field):
    with pytest.raises(InvalidField) as fault:
        text_decoding.decode_question(form, pairs)
    assert fault.value.field == field
