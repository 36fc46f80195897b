"""Feet of clips over HTTP and on the command line: the default, the two words, and the facts."""

import json
import subprocess
import sys

import jsonschema
import pytest
from asking import asker

from posefield.http.api.settings import Settings
from posefield.http.app import create_app
from posefield.http.readiness import Readiness
from posefield.inference import session
from posefield.registry.model_registry import ModelRegistry
from posefield.registry.model_reload import FixedRegistry
from posefield.synthesis.synthesizer import Synthesizer


@pytest.fixture(scope="module")
def walk(measured_walk_path):
    return Synthesizer("walk", session.load(measured_walk_path))


@pytest.fixture(scope="module")
def get(walk):
    ask = asker(create_app(Readiness(FixedRegistry(ModelRegistry({"walk": walk}))), Settings()))
    controls = {control.name: control.default for control in walk.session.card.controls}

    def answer(path="clip.json", **more):
        found = ask("GET", f"/v1/models/walk/{path}", params={**controls, **more})
        assert found.status_code == 200, found.text
        return found

    return answer


def test_the_facts_are_those_of_the_contract(get, spec):
    schema = {"$ref": "#/components/schemas/FeetResult", "components": spec["components"]}
    told = get(feet="stand").json()["trust"]["feet"]
    jsonschema.Draft202012Validator(schema).validate(told)
    assert len(told["stances"]) >= 2 and told["swings"] >= 2
    assert told["skate"] < told["skate_before"] and told["drift"] < 1e-6


def test_exact_speeds_stay_met(get):
    plain, placed = (get(feet=feet).json()["trust"] for feet in ("as_predicted", "stand"))
    assert "feet" not in plain
    assert placed["measured"] == plain["measured"] and placed["duration"] == plain["duration"]


def test_the_default_is_to_stand_and_answers_are_repeatable(get):
    assert get("clip.bvh").content == get("clip.bvh", feet="stand").content
    assert get("clip.bvh").content != get("clip.bvh", feet="as_predicted").content


def test_the_command_writes_the_bytes_of_the_service(get, walk, measured_walk_path, tmp_path):
    path = tmp_path / "walk.bvh"
    said = [
        word
        for control in walk.session.card.controls
        for word in ("-c", f"{control.name}={control.default!r}")
    ]
    command = [sys.executable, "-m", "posefield", "clip", str(measured_walk_path), *said]
    for feet in ("stand", "as_predicted"):
        done = subprocess.run([*command, "--feet", feet, "-o", str(path)], check=True, text=True)
        assert done.returncode == 0
        assert path.read_bytes() == get("clip.bvh", feet=feet).content
        path.unlink()
    told = tmp_path / "walk.json"
    subprocess.run([*command, "-o", str(told)], check=True)
    assert json.loads(told.read_text())["trust"]["feet"]["swings"] >= 2
