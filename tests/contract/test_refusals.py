"""Tests of invalid requests: status, location and message of each error."""

import json
from dataclasses import replace
from urllib.parse import urlencode

import pytest
import recorded
from asking import asker

from posefield.http.api.settings import Settings
from posefield.http.app import create_app
from posefield.registry.model_registry import ModelRegistry

CLIP = "/v1/models/reach/clip.json"
POSE = "/v1/models/reach/pose"
JSON = {"content-type": "application/json"}


@pytest.fixture
def assert_refused(ask, valid):
    """Ask, and hold the refusal against the one shape of errors."""

    def asked(status, kind, method, url, **content):
        answer = ask(method, url, **content)
        assert answer.headers["content-type"] == "application/problem+json", answer.text
        problem = answer.json()
        valid("Problem", problem)
        assert problem["status"] == answer.status_code == status, problem
        assert problem["type"] == f"urn:posefield:problem:{kind}"
        assert problem["instance"] == answer.headers["x-request-id"]
        assert answer.headers["x-content-type-options"] == "nosniff"
        return problem

    return asked


WRONG_PARAMETERS = [
    # changes to a right query, status, problem, parameter at fault, words of the detail
    ({"fps": "٣٠"}, 400, "bad-parameter", "fps", "expected a finite number"),
    ({"turn": "1e400"}, 400, "bad-parameter", "turn", "expected a finite number"),
    ({"turn": "1e3", "extrapolate": "refuse"}, 422, "outside-samples", "controls", "turn = 1000"),
    ({"turn": ["1", "2"]}, 400, "bad-parameter", "turn", "expected once"),
    ({"loop": "true"}, 422, "invalid-field", "loop", "true, expected false: this model's last"),
]


@pytest.mark.parametrize(("changes", "status", "kind", "name", "words"), WRONG_PARAMETERS)
def test_a_wrong_parameter_is_named(changes, status, kind, name, words, assert_refused, controls):
    given = {k: v for k, v in {**controls, **changes}.items() if v is not None}
    problem = assert_refused(status, kind, "GET", f"{CLIP}?{urlencode(given, doseq=True)}")
    assert [error["parameter"] for error in problem["errors"]] == [name]
    assert words in problem["detail"]


def test_an_unknown_parameter_is_named(assert_refused):
    problem = assert_refused(400, "bad-parameter", "GET", "/livez?verbose=1")
    assert problem["errors"][0]["parameter"] == "verbose"
    assert_refused(400, "bad-parameter", "GET", "/v1/models/reach?%ff=1")
    assert_refused(400, "bad-parameter", "POST", f"{POSE}?time=1", json={})


WRONG_BODIES = [
    # body, status, problem, pointer to the fault
    (b"{", 400, "bad-body", ""),
    (b"\xff\xfe", 400, "bad-body", ""),
    (b"{}", 400, "bad-body", "/controls"),
    (b'{"controls": {}, "frames": 3}', 400, "bad-body", "/frames"),
    (b'{"controls": {"turn": NaN}}', 400, "bad-body", ""),
    (b'{"controls": {"a/b~c": 1}}', 422, "invalid-field", "/controls/a~1b~0c"),
    (b'{"controls": {"turn": ' + b"[" * 20000 + b"]" * 20000 + b"}}", 400, "bad-body", "/controls"),
]


@pytest.mark.parametrize(("content", "status", "kind", "pointer"), WRONG_BODIES)
def test_a_wrong_body_is_pointed_at(content, status, kind, pointer, assert_refused):
    problem = assert_refused(status, kind, "POST", CLIP, content=content, headers=JSON)
    assert [error["pointer"] for error in problem["errors"]] == [pointer]


@pytest.mark.parametrize("media", ["text/plain", "application/xml", "application/json; charset=x"])
def test_another_media_type_is_refused(media, assert_refused):
    headers = {"content-type": media}
    problem = assert_refused(
        415, "unsupported-media-type", "POST", POSE, content=b"{}", headers=headers
    )
    assert "expected 'application/json'" in problem["detail"]


def test_a_media_type_may_name_utf8(ask, controls):
    content = json.dumps({"controls": controls, "times": [0]})
    headers = {"content-type": "application/json; charset=UTF-8"}
    assert ask("POST", POSE, content=content, headers=headers).status_code == 200


def test_reading_a_chunked_body_stops_at_the_limit(assert_refused):
    read = []

    async def endless():
        while True:
            read.append(1)
            yield b" " * 1024

    assert_refused(413, "body-too-large", "POST", POSE, content=endless(), headers=JSON)
    assert len(read) <= 66


@pytest.mark.parametrize("name", ["nobody", "reach@0000000000000000", "reach@", "..", "%00", "%2e"])
def test_an_unknown_model_is_refused(name, assert_refused):
    problem = assert_refused(404, "unknown-model", "GET", f"/v1/models/{name}x")
    assert "there are reach@" in problem["detail"]
    assert problem["errors"][0]["parameter"] == "model"


def test_an_unknown_format_names_the_formats_there_are(assert_refused):
    problem = assert_refused(404, "unknown-format", "GET", "/v1/models/reach/clip.fbx")
    assert "usda, usdc, usdz, json, bvh" in problem["detail"]
    assert problem["errors"][0]["parameter"] == "format"


@pytest.mark.parametrize("path", ["/v1/", "/v1", "/v1/models/", "/v1/models/reach/clip/"])
def test_an_unknown_path_is_refused(path, assert_refused):
    assert_refused(404, "no-such-path", "GET", path)


def test_another_method_is_told_which_are_allowed(ask, assert_refused):
    for path, allow in ((POSE, "GET, HEAD, OPTIONS, POST"), ("/livez", "GET, HEAD, OPTIONS")):
        assert_refused(405, "method-not-allowed", "TRACE", path)
        assert ask("PUT", path).headers["allow"] == allow


def largest(calls):
    """The most times that one call asked poses at."""
    return max((feed["time"].size for feed in calls if "time" in feed), default=0)


def test_an_answer_too_large_to_make_is_not_made(loaded, controls):
    model = loaded.find("reach")
    session, calls = recorded.session(model.session)
    one = ModelRegistry({"reach": replace(model, session=session)})
    small = asker(create_app(one, Settings(output_limit=64 * 1024)))
    url = f"/v1/models/reach/clip.usda?{urlencode({**controls, 'fps': 1000})}"
    answer = small("GET", url)
    assert answer.status_code == 422 and "frames, expected at most" in answer.json()["detail"]
    assert largest(calls) < 10
    # Negative control: made, it takes a pose a frame.
    assert asker(create_app(one, Settings()))("GET", url).status_code == 200
    assert largest(calls) > 500
    few = {"controls": {n: [v] * 200 for n, v in controls.items()}, "time": 0}
    answer = small("POST", "/v1/models/reach/crowd.arrow", json=few)
    assert answer.status_code == 422 and "200 characters, expected 1 to" in answer.json()["detail"]
