"""Feet of clips over HTTP: the default, the two words, and the facts."""

import io
import json
import zipfile

import pytest
from asking import asker

from posefield.http.api.settings import Settings
from posefield.http.app import create_app
from posefield.inference import session
from posefield.registry.model_registry import ModelRegistry
from posefield.synthesis.synthesizer import Synthesizer


@pytest.fixture(scope="module")
def walk(measured_walk_path):
    return Synthesizer("walk", session.load(measured_walk_path))


@pytest.fixture(scope="module")
def ask(walk):
    return asker(create_app(ModelRegistry({"walk": walk}), Settings()))


@pytest.fixture(scope="module")
def get(walk, ask):
    controls = {control.name: control.default for control in walk.session.card.controls}

    def answer(path="clip.json", **more):
        found = ask("GET", f"/v1/models/walk/{path}", params={**controls, **more})
        assert found.status_code == 200, found.text
        return found

    return answer


def test_the_facts_are_those_of_the_contract(get, valid):
    told = get(feet="stand").json()["trust"]["feet"]
    valid("FeetResult", told)
    assert len(told["stances"]) >= 2 and told["swings"] >= 2
    assert told["skate"] < told["skate_before"] and told["drift"] < 1e-6


def test_the_default_is_to_stand_and_answers_are_repeatable(get):
    assert get("clip.bvh").content == get("clip.bvh", feet="stand").content
    assert get("clip.bvh").content != get("clip.bvh", feet="as_predicted").content


def test_a_floor_is_one_answer_in_a_link_a_body_and_an_archive(ask, get, valid):
    plane = {"height": 0.1, "slope_x": 0.0, "slope_z": 0.2}
    linked = get("clip.json", floor="0.1,0,0.2")
    body = {"controls": linked.json()["trust"]["controls"], "floor": plane}
    sent = ask("POST", "/v1/models/walk/clip.json", json=body)
    assert sent.status_code == 200 and sent.content == linked.content
    told = linked.json()["trust"]["feet"]
    assert told["floor"] == plane
    valid("FeetResult", told)
    assert get("clip.bvh", floor="0").content == get("clip.bvh").content
    many = {"format": "json", "clips": [body, {**body, "floor": 0.2}]}
    archive = ask("POST", "/v1/models/walk/clips.zip", json=many)
    assert archive.status_code == 200, archive.text
    with zipfile.ZipFile(io.BytesIO(archive.content)) as found:
        clips = [
            json.loads(found.read(name)) for name in sorted(found.namelist()) if "clip" in name
        ]
    floors = [clip["trust"]["feet"]["floor"]["slope_z"] for clip in clips]
    assert floors == [0.2, 0.0]
