"""Tests of questions as query parameters and as JSON: equal results."""

import json
import math
from urllib.parse import parse_qsl

import pytest
from hypothesis import given
from hypothesis import strategies as st

from posefield.common.errors import FormError
from posefield.http.request import query_pairs
from posefield.question import json_decoding, text_decoding
from posefield.question.model_question import SigmaQuestion, WhyQuestion
from posefield.question.motion_question import FileQuestion, PoseQuestion


def test_what_is_left_out_has_one_default():
    expected = FileQuestion(controls={})
    assert text_decoding.decode_question(FileQuestion, []) == expected
    assert text_decoding.decode_question(FileQuestion, [("loop", "false")]) == expected
    assert json_decoding.decode_question(FileQuestion, b'{"controls": {}}') == expected
    nothing = b'{"controls": {}, "end": null, "unit": null, "up": null, "loop": false}'
    assert json_decoding.decode_question(FileQuestion, nothing) == expected


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_a_number_survives_the_query(number):
    asked = text_decoding.decode_question(FileQuestion, [("turn", repr(number))])
    assert asked.controls == {"turn": number}


@given(st.text())
def test_any_text_is_a_finite_number_or_refused(text):
    try:
        value = text_decoding.decode_question(FileQuestion, [("turn", text)]).controls["turn"]
    except FormError:
        pass
    else:
        assert math.isfinite(value)


@given(st.binary())
def test_bytes_that_are_no_question_are_refused(content):
    with pytest.raises(FormError):
        json_decoding.decode_question(PoseQuestion, content)


@given(st.text(alphabet="ab&=;%+2f é", max_size=24))
def test_a_query_is_read_as_the_standard_library_reads_it(text):
    raw = text.encode()
    assert query_pairs(raw) == parse_qsl(raw.decode("latin-1"), keep_blank_values=True)


PAIRS = [("turn", "20"), ("stature", "1.7")]
BODY = {"controls": {"stature": 1.7, "turn": 20}}
GRID = {"across": "a", "along": "b", "rows": 3}
MADE = {"names": "ue5", "root": "in_place", "unit": "cm", "up": "z"}
CASES = {
    PoseQuestion: ([("time", "0.5")], {"times": [0.5]}),
    FileQuestion: ([*MADE.items(), ("loop", "true")], {**MADE, "loop": True}),
    WhyQuestion: ([("nearest", "3")], {"nearest": 3.0}),
    SigmaQuestion: ([(name, str(value)) for name, value in GRID.items()], GRID),
}


@pytest.mark.parametrize("form", CASES)
def test_every_way_to_ask_is_one_question(form):
    pairs, rest = [*PAIRS, *CASES[form][0]], {**BODY, **CASES[form][1]}
    first = text_decoding.decode_question(form, pairs)
    assert text_decoding.decode_question(form, pairs[::-1]) == first
    assert json_decoding.decode_question(form, json.dumps(rest).encode()) == first
    assert (
        json_decoding.decode_question(form, json.dumps(dict(reversed(rest.items()))).encode())
        == first
    )
    other = [(key, "1.8" if key == "stature" else text) for key, text in pairs]
    assert text_decoding.decode_question(form, other) != first
