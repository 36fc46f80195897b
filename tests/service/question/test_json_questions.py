"""Tests of msgspec errors as JSON pointers, in linear time."""

import json
import time
from typing import Annotated

import msgspec
import pytest

from posefield.common.errors import FormError, InvalidField
from posefield.question import json_decoding as bodies
from posefield.question.json_decoding import decode_question
from posefield.question.model_question import SigmaQuestion, WhyQuestion
from posefield.question.motion_question import (
    ClipsQuestion,
    FileQuestion,
    PoseQuestion,
    check_range,
)
from posefield.question.performance_question import PerformanceQuestion
from posefield.question.walk_question import WalkQuestion


class Inner(msgspec.Struct, forbid_unknown_fields=True):
    """One of several things in a body."""

    size: Annotated[float, msgspec.Meta(ge=0)]


class Outer(msgspec.Struct, forbid_unknown_fields=True):
    """A body."""

    inner: list[Inner]
    name: str = ""


def pointer(content):
    with pytest.raises(FormError) as caught:
        bodies.decode_question(Outer, json.dumps(content).encode())
    return f"/{caught.value.field}" if caught.value.field else ""


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        ({"inner": [], "frames": 3}, "/frames"),
        ({}, "/inner"),
        ({"inner": [{"size": 1}, {"size": -1}]}, "/inner/1/size"),
        ([], ""),
        ({"inner": [], "a/b~c": 1}, "/a~1b~0c"),
        ({"inner": [], "line\nfeed`": 1}, "/line\nfeed`"),
    ],
)
def test_a_complaint_leads_to_its_place(content, expected):
    assert pointer(content) == expected


def seconds(count):
    body = {"field `" * count + "\n": 1}
    begun = time.process_time()
    pointer(body)
    return time.process_time() - begun


def test_a_long_key_takes_no_time_that_grows_with_its_square():
    # 32 times as long: 1,024 times the time for an expression that backtracks, 32 for none.
    short = min(seconds(4_000) for _ in range(5))
    assert min(seconds(128_000) for _ in range(3)) < 200 * max(short, 1e-4)


@pytest.mark.parametrize(
    ("form", "content", "path", "said"),
    [
        (
            FileQuestion,
            '{"controls":{"a":1,"b":"x"}}',
            "controls/b",
            "Expected `float`, got `str` 'x'",
        ),
        (FileQuestion, "{", "", "expected UTF-8 JSON; Input data was truncated"),
        (FileQuestion, "[" * 100_000, "", "Expected `object`, got `array`"),
        (
            ClipsQuestion,
            '{"format":"bvh","clips":[{"controls":{}},{"controls":{"a":true}}]}',
            "clips/1/controls/a",
            "Expected `float`, got `bool` True",
        ),
    ],
)
def test_a_body_that_is_no_question_is_named(form, content, path, said):
    with pytest.raises(FormError) as caught:
        bodies.decode_question(form, content.encode())
    assert caught.value.field == path and caught.value.message == said
    assert str(caught.value) == (f"{path}: {said}" if path else said)


def test_a_byte_order_mark_is_left_out():
    content = b'{"segments":[{"kind":"walk","model":"a","seconds":1}]}'
    marked = "\ufeff".encode() + content
    assert decode_question(PerformanceQuestion, marked) == decode_question(
        PerformanceQuestion, content
    )


def test_whole_numbers_may_be_written_as_json_writes_them():
    for level in ("1", "1.0", "10e-1"):
        body = f'{{"controls":{{"a":1.0}},"level":{level}}}'.encode()
        found = bodies.decode_question(FileQuestion, body)
        assert found == FileQuestion(controls={"a": 1.0}, level=1) and type(found.level) is int


TARGET = '{"controls": {}, "times": [0], "targets": [{"joint": "A", %s}]}'


@pytest.mark.parametrize(
    ("body", "said"),
    [
        (
            TARGET % '"pos": [0, 1, 0]',
            "targets/0/pos: Object contains unknown field `pos` (did you mean 'position'?), "
            "expected some of joint, position, time, at",
        ),
        (
            TARGET % '"position": [0, 1, 0], "at": "strat"',
            "targets/0/at: Invalid enum value 'strat' (did you mean 'start'?), expected one of "
            "start, end, event, highest, lowest, farthest",
        ),
    ],
)
def test_an_unknown_name_is_answered_with_those_that_are_known(body, said):
    with pytest.raises(FormError) as caught:
        decode_question(PoseQuestion, body.encode())
    assert str(caught.value) == said


HUGE = "1" + "0" * 400


@pytest.mark.parametrize("number", [HUGE, "1e300", "9223372036854775808"])
@pytest.mark.parametrize(
    ("form", "body", "field"),
    [
        (WhyQuestion, '{"controls":{},"nearest":%s}', "nearest"),
        (SigmaQuestion, '{"across":"a","along":"b","rows":%s}', "rows"),
        (PoseQuestion, '{"controls":{},"times":[0],"level":%s}', "level"),
        (FileQuestion, '{"controls":{},"take":%s}', "take"),
        (PerformanceQuestion, '{"segments":[{"kind":"hold","seconds":1}],"take":%s}', "take"),
        (WalkQuestion, '{"count":%s}', "count"),
    ],
)
def test_an_integer_beyond_floats_is_refused_by_the_name_of_its_field(form, body, field, number):
    with pytest.raises(FormError) as caught:
        decode_question(form, (body % number).encode())
    assert caught.value.field == field
    assert len(str(caught.value)) < 200


def test_no_range_of_an_integer_overflows_in_its_message():
    with pytest.raises(InvalidField, match="nearest"):
        check_range("nearest", int(HUGE), 1, 10, "clips")
