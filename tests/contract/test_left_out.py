"""Tests of inferred controls: every format reports the controls that a request omits."""

import json
from urllib.parse import urlencode

import pytest

MODEL = "/v1/models/reach"
GIVEN = {"turn": 20.0, "target_height": 1.1}
LEFT_OUT = ["stature", "hip_height"]


def asked(path, given=GIVEN, **more):
    return f"{MODEL}/{path}?{urlencode({**given, **more})}"


@pytest.fixture(scope="module")
def chosen(ask):
    """Trust of a pose for which two controls were left out."""
    return ask("GET", asked("pose.json", time=0)).json()["trust"]


def test_what_was_chosen_asks_for_the_same(ask, chosen):
    assert chosen["inferred"] == LEFT_OUT
    assert list(chosen["controls"]) == ["stature", "hip_height", "turn", "target_height"]
    assert chosen["controls"].items() >= GIVEN.items()
    part = ask("GET", asked("pose.json", time=0)).json()
    whole = ask("GET", asked("pose.json", chosen["controls"], time=0)).json()
    assert part["trust"].pop("inferred") and "inferred" not in whole["trust"]
    assert part == whole


def test_nothing_at_all_may_be_given(ask):
    by_query = ask("GET", f"{MODEL}/pose.json?time=0").json()
    by_body = ask("POST", f"{MODEL}/pose.json", json={"controls": {}, "times": [0]}).json()
    assert by_query == by_body
    assert by_query["trust"]["inferred"] == [*LEFT_OUT, *GIVEN]
    tall = ask("GET", f"{MODEL}/pose.json?time=0&performer=tall").json()["trust"]
    short = ask("GET", f"{MODEL}/pose.json?time=0&performer=short").json()["trust"]
    assert short["controls"]["stature"] < tall["controls"]["stature"]


def test_clips_and_reasons_say_it(ask, chosen, controls):
    for path in ("clip.json", "why"):
        partly, whole = (ask("GET", asked(path, given)).json() for given in (GIVEN, controls))
        trust = partly.get("trust", partly)
        assert (trust["inferred"], trust["controls"]) == (LEFT_OUT, chosen["controls"])
        assert "inferred" not in whole.get("trust", whole)


@pytest.mark.parametrize("extension", ["usda", "usdc", "glb", "bvh"])
def test_a_file_says_it_in_a_header(extension, ask, chosen, controls):
    found = ask("GET", asked(f"clip.{extension}"))
    values = {name: chosen["controls"][name] for name in LEFT_OUT}
    assert json.loads(found.headers["posefield-inferred"]) == values
    whole = ask("GET", asked(f"clip.{extension}", chosen["controls"]))
    assert "posefield-inferred" not in whole.headers
    if extension == "bvh":
        assert found.content == whole.content
    else:
        assert b"inferred" in found.content and b"inferred" not in whole.content
