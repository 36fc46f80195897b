"""Tests of canonical questions: independent of form and order."""

import json

import pytest

from posefield.question import json_decoding, text_decoding
from posefield.question.model_question import SigmaQuestion, WhyQuestion
from posefield.question.motion_question import FileQuestion, PoseQuestion

PAIRS = [("turn", "20"), ("stature", "1.7")]
BODY = {"controls": {"stature": 1.7, "turn": 20}}
GRID = {"across": "a", "along": "b", "rows": 3}
CASES = {
    PoseQuestion: ([("time", "0.5")], {"times": [0.5]}),
    FileQuestion: ([("fps", "25")], {"fps": 25}),
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
