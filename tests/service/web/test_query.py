"""Both ways to ask lead to one question."""

import json
import math
from urllib.parse import parse_qsl

import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.synthesis.question import ClipQuestion, PoseQuestion
from service.web import query
from service.web.problems import RequestFault
from service.web.query import FileQuestion


def test_a_query_and_a_body_are_one_pose_question():
    expected = PoseQuestion({"turn": 20.0, "stature": 1.7}, [0.0, 0.5], "refuse", "12")
    pairs = [("turn", "20"), ("time", "0"), ("stature", "1.7"), ("time", "0.5")]
    # A name may look like a number.
    rest = [("extrapolate", "refuse"), ("performer", "12")]
    assert query.pose_of_pairs([*pairs, *rest]) == expected
    body = (
        b'{"controls": {"turn": 20, "stature": 1.7}, "times": [0, 5e-1], '
        b'"extrapolate": "refuse", "performer": "12"}'
    )
    assert query.pose_of_body(body) == expected


def test_a_query_and_a_body_are_one_clip_question():
    expected = ClipQuestion({"turn": -2.0}, 60.0, "warn", 0.1, 0.9, "ada")
    pairs = [("turn", "-2"), ("fps", "60"), ("start", "0.1"), ("end", "0.9"), ("performer", "ada")]
    assert query.file_of_pairs(pairs) == FileQuestion(expected)
    body = b'{"controls": {"turn": -2}, "fps": 60, "start": 0.1, "end": 0.9, "performer": "ada"}'
    assert query.file_of_body(body) == FileQuestion(expected)


def test_a_query_and_a_body_say_alike_how_a_file_is_made():
    clip = ClipQuestion({"turn": -2.0}, names="ue5", root="in_place", loop=True)
    expected = FileQuestion(clip, "cm", "z")
    said = {"names": "ue5", "root": "in_place", "unit": "cm", "up": "z"}
    assert query.file_of_pairs([("turn", "-2"), ("loop", "true"), *said.items()]) == expected
    body = {"controls": {"turn": -2}, "loop": True, **said}
    assert query.file_of_body(json.dumps(body).encode()) == expected


def test_what_is_left_out_has_one_default():
    expected = FileQuestion(ClipQuestion({}))
    assert query.file_of_pairs([]) == expected
    assert query.file_of_pairs([("loop", "false")]) == expected
    assert query.file_of_body(b'{"controls": {}}') == expected
    nothing = b'{"controls": {}, "end": null, "unit": null, "up": null, "loop": false}'
    assert query.file_of_body(nothing) == expected


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_a_number_survives_the_query(number):
    asked = query.file_of_pairs([("turn", repr(number))])
    assert asked.clip.controls == {"turn": number}


@given(st.text())
def test_any_text_is_a_finite_number_or_refused(text):
    try:
        value = query.file_of_pairs([("turn", text)]).clip.controls["turn"]
    except RequestFault as fault:
        assert fault.kind.status == 400
    else:
        assert math.isfinite(value)


@given(st.binary())
def test_any_bytes_are_a_question_or_refused(content):
    with pytest.raises(RequestFault):
        query.pose_of_body(content)


@given(st.text(alphabet="ab&=;%+2f é", max_size=24))
def test_a_query_is_read_as_the_standard_library_reads_it(text):
    raw = text.encode()
    assert query.pairs(raw) == parse_qsl(raw.decode("latin-1"), keep_blank_values=True)
