"""Tests of many clips over HTTP: archives equal to single clips, and errors."""

import hashlib
import json

import jsonschema
import pytest
from asking import asker, unpacked

from posefield.encode.archives import ARCHIVE_WRITERS
from posefield.encode.formats import CLIP_ENCODERS
from posefield.http.api.settings import Settings
from posefield.http.app import create_app

CLIPS = "/v1/models/reach/clips"
JSON = {"content-type": "application/json"}


@pytest.fixture
def questions(controls):
    """Clips that differ in all that can be asked."""
    turned = {**controls, "turn": controls["turn"] + 5}
    return [
        {"controls": controls, "name": "as.it-is_1"},
        {"controls": turned, "fps": 60, "start": 0.1, "end": 0.5},
        {"controls": turned, "performer": "tall", "level": 2, "extrapolate": "refuse"},
        {"controls": {**controls, "turn": 1000.0}},
    ]


NAMES = ["as.it-is_1", "clip-000001", "clip-000002", "clip-000003"]


def asked(extension, clips):
    return {"format": extension, "clips": clips}


@pytest.mark.parametrize("kind", ARCHIVE_WRITERS)
@pytest.mark.parametrize("extension", CLIP_ENCODERS)
def test_each_file_is_what_its_own_path_answers(extension, kind, ask, questions):
    answer = ask("POST", f"{CLIPS}.{kind}", json=asked(extension, questions))
    assert answer.status_code == 200, answer.text
    found = unpacked(kind, answer.content)
    assert list(found) == [*(f"{name}.{extension}" for name in NAMES), "manifest.jsonl"]
    contents = list(found.values())
    for question, content in zip(questions, contents, strict=False):
        alone = {key: value for key, value in question.items() if key != "name"}
        assert ask("POST", f"/v1/models/reach/clip.{extension}", json=alone).content == content
    assert len(set(contents)) == len(contents)


@pytest.mark.parametrize("kind", ARCHIVE_WRITERS)
def test_the_manifest_says_what_each_file_is(kind, ask, questions, spec):
    answer = ask("POST", f"{CLIPS}.{kind}", json=asked("json", questions))
    found = unpacked(kind, answer.content)
    lines = [json.loads(line) for line in found.pop("manifest.jsonl").splitlines()]
    schema = {**spec["components"]["schemas"]["ManifestEntry"], "components": spec["components"]}
    assert [line["file"] for line in lines] == list(found)
    assert [line["name"] for line in lines] == NAMES
    for line, content in zip(lines, found.values(), strict=True):
        jsonschema.validate(line, schema, jsonschema.Draft202012Validator)
        assert set(schema["required"]) <= line.keys() <= schema["properties"].keys()
        # Nothing was left out of these questions, and they are held to nothing.
        assert not line.keys() & {"inferred", "targets"}
        assert line["sha256"] == hashlib.sha256(content).hexdigest()
        assert line["bytes"] == len(content)
        clip = json.loads(content)
        assert line["frames"] == clip["frames"]
        assert {key: line[key] for key in clip["trust"]} == clip["trust"]


REFUSED = {
    # what is changed of the clip in the middle, status, end of the pointer, words of the detail
    "a control out of reach": ({"controls": {"turn": 1e9}}, 422, "controls/turn", "expected"),
    "a word for a control": ({"controls": {"turn": "x"}}, 400, "controls/turn", "Expected `float`"),
    "a path for a name": ({"name": "../up"}, 400, "name", "matching"),
    "a name in other capitals": ({"name": "FIRST"}, 422, "name", "'FIRST', expected a name of"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_a_clip_that_cannot_be_is_named(name, ask, controls):
    changes, status, field, words = REFUSED[name]
    wrong = {**changes, "controls": {**controls, **changes.get("controls", {})}}
    clips = [{"controls": controls, "name": "first"}, {"controls": controls}, wrong]
    assert_refused(
        ask("POST", f"{CLIPS}.zip", json=asked("usdc", clips)), status, f"2/{field}", words
    )


def assert_refused(answer, status, place, words):
    problem = answer.json()
    assert answer.status_code == problem["status"] == status, problem
    assert answer.headers["content-type"] == "application/problem+json"
    assert problem["errors"][0]["pointer"] == f"/clips/{place}", problem
    assert words in problem["detail"], problem


def test_a_name_that_another_clip_is_given_is_refused(ask, controls):
    clips = [{"controls": controls, "name": "Clip-000001"}, {"controls": controls}]
    answer = ask("POST", f"{CLIPS}.zip", json=asked("usdc", clips))
    assert_refused(answer, 422, "1/name", "'clip-000001', expected a name of its own")


WRONG = {
    "no clips": ({"format": "usdc", "clips": []}, 422, "/clips"),
    "a clip that is none": ({"format": "usdc", "clips": [5]}, 400, "/clips/0"),
}


@pytest.mark.parametrize("name", WRONG)
def test_a_body_that_is_none_is_refused(name, ask):
    body, status, pointer = WRONG[name]
    answer = ask("POST", f"{CLIPS}.tar", json=body)
    assert answer.status_code == status, answer.text
    assert answer.json()["errors"][0]["pointer"] == pointer, answer.text


def test_more_than_the_service_takes_is_refused_before_it_is_made(loaded, controls):
    limits = Settings(clips_limit=3, clips_poses=100, clips_body_limit=2000)
    small = asker(create_app(loaded, limits))
    short, long = ({"controls": controls, "fps": fps} for fps in (10, 1000))
    assert small("POST", f"{CLIPS}.zip", json=asked("usdc", [short] * 3)).status_code == 200
    many = small("POST", f"{CLIPS}.zip", json=asked("usdc", [short] * 4))
    assert many.status_code == 422 and "4 clips, expected 1 to 3" in many.json()["detail"]
    slow = small("POST", f"{CLIPS}.zip", json=asked("usdc", [short, long]))
    assert slow.status_code == 422 and "expected at most 100" in slow.json()["detail"]
    large = small("POST", f"{CLIPS}.zip", content=b" " * 2001, headers=JSON)
    assert large.status_code == 413


def test_targets_of_all_clips_are_bounded(loaded, controls):
    small = asker(create_app(loaded, Settings(clips_targets=8)))
    places = [{"joint": "RightHand", "time": t, "position": [0.2, 1.2, 0.4]} for t in (0.2, 0.5)]
    given, open_ = ({"controls": own, "targets": places} for own in (controls, {}))
    for clips, cost in (([given] * 4, 8), ([open_], 8), ([given] * 5, 10), ([given, open_], 10)):
        answer = small("POST", f"{CLIPS}.tar", json=asked("json", clips))
        assert answer.status_code == (200 if cost <= 8 else 422), answer.text
        if cost > 8:
            assert f"targets of all clips cost {cost}, expected at most 8" in answer.text
            assert answer.json()["errors"][0]["pointer"] == "/clips"


def test_a_clip_of_an_archive_is_as_large_as_one_alone_may_be(loaded, controls):
    small = asker(create_app(loaded, Settings(output_limit=200_000)))
    clip = {"controls": controls, "fps": 1000}
    alone = small("POST", "/v1/models/reach/clip.json", json=clip)
    within = small("POST", f"{CLIPS}.tar", json=asked("json", [{"controls": controls}, clip]))
    assert alone.status_code == within.status_code == 422
    assert within.json()["detail"].endswith(alone.json()["detail"])
