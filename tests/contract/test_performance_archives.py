"""Many performances over HTTP: archives equal to single performances, limits, and errors."""

import hashlib
import json

import bad_scripts
import jsonschema
import pytest
from asking import asker, unpacked
from bad_scripts import ABSENT, REFUSED, UNREADABLE

from posefield.encode.archives import ARCHIVE_WRITERS
from posefield.encode.formats import CLIP_ENCODERS
from posefield.http.api.settings import Settings
from posefield.http.app import create_app

BATCH = "/v1/performances/batch"
JSON = "application/json"
FIRST = bad_scripts.walk(seconds=1.0, speed=1.0)
SCRIPTS = [
    {**FIRST, "name": "as.it-is_1"},
    {**bad_scripts.walk(seconds=1.0), "start": {"position": [1, 2], "heading": 0.5}, "fps": 20},
    {**bad_scripts.walk(seconds=1.0), "feet": "as_predicted", "take": 3},
]
NAMES = ["as.it-is_1", "performance-000001", "performance-000002"]
FAR_MODEL = {"segments": [{"kind": "walk", "model": "gone", "seconds": 1.0}]}


def asked(extension, scripts, **more):
    return {"format": extension, "scripts": scripts, **more}


def alone(script):
    return {key: value for key, value in script.items() if key != "name"}


# Files of avatars need a whole body, and these walkers are legs alone.
BODIES = [name for name, encoder in CLIP_ENCODERS.items() if not encoder.is_humanoid]


def test_bodies_that_a_format_cannot_move_are_refused(ask):
    answer = ask("POST", f"{BATCH}.zip", json=asked("vrma", SCRIPTS))
    assert answer.status_code == 422
    assert "expected a body with all humanoid bones of VRM" in answer.json()["detail"]


@pytest.mark.parametrize("extension", BODIES)
def test_each_file_is_what_its_own_path_answers(extension, ask):
    answer = ask("POST", f"{BATCH}.zip", json=asked(extension, SCRIPTS))
    assert answer.status_code == 200, answer.text
    found = unpacked("zip", answer.content)
    assert list(found) == [*(f"{name}.{extension}" for name in NAMES), "manifest.jsonl"]
    for script, content in zip(SCRIPTS, found.values(), strict=False):
        path = f"/v1/performances.{extension}"
        assert ask("POST", path, json=alone(script)).content == content
    assert len(set(found.values())) == len(found)


@pytest.mark.parametrize("kind", ARCHIVE_WRITERS)
def test_the_manifest_says_what_each_file_is(kind, ask, spec):
    answer = ask("POST", f"{BATCH}.{kind}", json=asked("json", SCRIPTS))
    found = unpacked(kind, answer.content)
    lines = [json.loads(line) for line in found.pop("manifest.jsonl").splitlines()]
    schema = spec["components"]["schemas"]["PerformanceEntry"]
    schema = {**schema, "components": spec["components"]}
    assert [line["file"] for line in lines] == list(found)
    assert [line["name"] for line in lines] == NAMES
    for line, content in zip(lines, found.values(), strict=True):
        jsonschema.validate(line, schema, jsonschema.Draft202012Validator)
        assert set(schema["required"]) <= line.keys() <= schema["properties"].keys()
        assert line["sha256"] == hashlib.sha256(content).hexdigest()
        assert line["bytes"] == len(content)
        report = json.loads(content)["trust"]
        assert {key: line[key] for key in report} == report
    assert answer.headers["content-disposition"] == f'attachment; filename="performances.{kind}"'


def assert_refused(answer, status, pointer, words=""):
    problem = answer.json()
    assert answer.status_code == problem["status"] == status, problem
    assert answer.headers["content-type"] == "application/problem+json"
    assert [own["pointer"] for own in problem["errors"]] == [pointer], problem
    assert words in problem["detail"], problem


# One of each kind: all of them are tried in process.
@pytest.mark.parametrize(("scripts", "status"), [(UNREADABLE, 400), (REFUSED, 422), (ABSENT, 404)])
def test_a_script_at_fault_is_named(ask, scripts, status):
    document, pointer, *words = next(iter(scripts.values()))
    answer = ask("POST", f"{BATCH}.zip", json=asked("npz", [FIRST, document]))
    assert_refused(answer, status, f"/scripts/1{pointer}", words[0] if words else "")


def test_counts_are_limited_before_any_work(loaded):
    limits = Settings(performances_limit=3, performances_segments=4, clips_body_limit=2000)
    small = asker(create_app(loaded, limits))
    many = small("POST", f"{BATCH}.zip", json=asked("bvh", [FAR_MODEL] * 4))
    assert_refused(many, 422, "/scripts", "4 scripts, expected 1 to 3")
    long = {"segments": FAR_MODEL["segments"] * 3}
    segments = small("POST", f"{BATCH}.zip", json=asked("bvh", [long, FAR_MODEL, FAR_MODEL]))
    assert_refused(segments, 422, "/scripts", "5 segments in all, expected at most 4")
    absent = small("POST", f"{BATCH}.zip", json=asked("bvh", [FAR_MODEL] * 3))
    assert_refused(absent, 404, "/scripts/0/segments/0/model")
    large = small("POST", f"{BATCH}.zip", content=b" " * 2001, headers={"content-type": JSON})
    assert large.status_code == 413
    assert small("POST", f"{BATCH}.zip", json=asked("bvh", [FIRST] * 3)).status_code == 200
