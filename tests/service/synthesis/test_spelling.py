"""Targets and exact controls in words and as plain values."""

import pytest

from service.motion.errors import InvalidField
from service.synthesis import spelling
from service.synthesis.question import HOLD, Hold, Target


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("rhand@end:0.3,1.2,-0.4", Target("rhand", (0.3, 1.2, -0.4), "end")),
        ("rhand@0.8:1,2,3", Target("rhand", (1, 2, 3), 0.8)),
        ("mixamorig:Hand@farthest:1e-3,0,0", Target("mixamorig:Hand", (0.001, 0, 0), "farthest")),
        ("a@b@event:0,0,0", Target("a@b", (0, 0, 0), "event")),
        ("左手@-1:0,0,0", Target("左手", (0, 0, 0), -1.0)),
    ],
)
def test_words_are_targets(words, expected):
    assert spelling.target(words) == expected
    other = "=".join(words.rsplit(":", 1))
    assert spelling.target(other, "=") == expected


@pytest.mark.parametrize(
    "words",
    [
        "",
        "rhand",
        "rhand@end",
        "@end:0,0,0",
        "rhand:0,0,0",
        "rhand@:0,0,0",
        "rhand@soon:0,0,0",
        "rhand@end:0,0",
        "rhand@end:0,0,0,0",
        "rhand@end:0,0,nan",
        "rhand@end:0,0,1e999",
        "rhand@end:0,0, 1",
        "rhand@1_0:0,0,0",
        "rhand@end=0,0,0",
    ],
)
def test_other_words_are_none(words):
    with pytest.raises(ValueError, match="expected JOINT@MOMENT:X,Y,Z, m; a moment is seconds or"):
        spelling.target(words)


HAND = {"joint": "hand", "position": [0, 1.5, 2], "time": 1}


def test_plain_values_are_targets():
    assert spelling.plain_target(HAND) == Target("hand", (0.0, 1.5, 2.0), 1)
    at = {"joint": "hand", "position": [0, 1, 2], "at": "lowest"}
    assert spelling.plain_target(at) == Target("hand", (0.0, 1.0, 2.0), "lowest")


@pytest.mark.parametrize(
    "found",
    [
        None,
        [],
        "hand@end:0,0,0",
        {**HAND, "joint": 3},
        {**HAND, "position": [0, 1]},
        {**HAND, "position": [0, 1, True]},
        {**HAND, "position": "0,1,2"},
        {**HAND, "at": "end"},
        {**HAND, "frame": 3},
        {**HAND, "time": None},
        {"joint": "hand", "position": [0, 1, 2]},
        {"joint": "hand", "position": [0, 1, 2], "at": "soon"},
        {"joint": "hand", "position": [0, 1, 2], "at": ["end"]},
    ],
)
def test_other_values_are_none(found):
    with pytest.raises(ValueError, match="expected joint, position"):
        spelling.plain_target(found)


def test_exact_controls_in_words():
    assert spelling.exact("auto") == "auto"
    assert spelling.exact("none") == "none"
    assert spelling.exact("speed") == ("speed",)
    assert spelling.exact("speed,turn") == ("speed", "turn")
    for words in ("", ",", "speed,"):
        with pytest.raises(ValueError, match="expected auto, none or names"):
            spelling.exact(words)


def test_what_a_command_line_says():
    assert spelling.hold(None, (), False) is HOLD
    assert spelling.hold("none", ["hand@end=0,1,2"], True) == Hold(
        "none", (Target("hand", (0, 1, 2), "end"),), True
    )
    with pytest.raises(InvalidField, match="target: 'hand', expected JOINT@MOMENT=X,Y,Z"):
        spelling.hold(None, ["hand"], False)
    with pytest.raises(InvalidField, match="exact: '', expected auto"):
        spelling.hold("", (), False)
