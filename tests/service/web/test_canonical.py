"""The same question is the same words, however it was put."""

import json

import pytest

from service.web import query, sigma_query, why_query
from service.web.settings import Settings

BOUNDS = Settings()
PAIRS = [("turn", "20"), ("stature", "1.7")]
BODY = {"controls": {"stature": 1.7, "turn": 20}}
CASES = {
    "pose": (
        [*PAIRS, ("time", "0.5")],
        query.pose_of_pairs,
        {**BODY, "times": [0.5]},
        query.pose_of_body,
    ),
    "clip": ([*PAIRS, ("fps", "25")], query.file_of_pairs, {**BODY, "fps": 25}, query.file_of_body),
    "why": (
        [*PAIRS, ("nearest", "3")],
        why_query.of_pairs,
        {**BODY, "nearest": 3.0},
        why_query.of_body,
    ),
    "sigma": (
        [*PAIRS, ("across", "a"), ("along", "b"), ("rows", "3")],
        lambda pairs: sigma_query.of_pairs(pairs, BOUNDS),
        {**BODY, "across": "a", "along": "b", "rows": 3},
        lambda content: sigma_query.of_body(content, BOUNDS),
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_a_question_has_one_way_to_be_written(name):
    pairs, of_pairs, body, of_body = CASES[name]
    written = {
        repr(of_pairs(pairs)),
        repr(of_pairs(pairs[::-1])),
        repr(of_body(json.dumps(body).encode())),
        repr(of_body(json.dumps(dict(reversed(body.items()))).encode())),
    }
    assert len(written) == 1
    other = [(key, "1.8" if key == "stature" else text) for key, text in pairs]
    assert repr(of_pairs(other)) not in written
