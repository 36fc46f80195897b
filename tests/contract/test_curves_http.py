"""Curves over HTTP: a model with them names them on its card and in its answers, others do not."""

import json

import numpy as np
import pytest
from asking import asker

from posefield.http.api.settings import Settings
from posefield.http.app import create_app
from posefield.registry import model_registry

QUERY = "smile=0.7&openness=0.5"
CONTROLS = {"smile": 0.7, "openness": 0.5}
SINGLE = 1e-5


@pytest.fixture(scope="module")
def face(model_file):
    return asker(create_app(model_registry.load([model_file("face")]), Settings()))


def test_the_card_describes_each_curve(face, valid):
    card = face("GET", "/v1/models/face").json()
    valid("ModelCard", card)
    assert card["curves"][0] == {
        "name": "jawOpen",
        "minimum": 0.0,
        "maximum": 1.0,
        "distance": 0.02,
    }
    assert len(card["curves"]) == 11


def test_pose_and_clip_have_equal_curves(face, valid):
    clip = face("GET", f"/v1/models/face/clip.json?{QUERY}&fps=10").json()
    body = {"controls": CONTROLS, "times": clip["times"]}
    pose = face("POST", "/v1/models/face/pose", json=body).json()
    valid("ClipDocument", clip)
    valid("PoseAnswer", pose)
    card = face("GET", "/v1/models/face").json()
    assert clip["curve_names"] == [curve["name"] for curve in card["curves"]]
    found, expected = np.array(pose["curves"]), np.array(clip["curves"])
    assert np.abs(found - expected).max() < SINGLE
    assert np.abs(found[1:] - expected[:-1]).max() > 0.1


@pytest.mark.parametrize("path", ["", "/clip.json?fps=5", "/pose?time=0.5"])
def test_a_model_without_curves_says_nothing_of_them(ask, face, path):
    first = "&" if "?" in path else "?"
    asked = "" if path == "" else f"{first}{QUERY}"
    assert "curve" not in ask("GET", f"/v1/models/reach{path}").text
    assert "curve" in face("GET", f"/v1/models/face{path}{asked}").text


def warnings(found):
    return [json.loads(text) for text in found.headers.get_list("Posefield-Warning")]


def test_bvh_says_that_it_carries_no_curves_and_what_does(face, ask):
    found = face("GET", f"/v1/models/face/clip.bvh?{QUERY}")
    (said,) = warnings(found)
    assert said.startswith("bvh files carry no curves: 11 are left out (jawOpen, ")
    assert said.endswith("usda, usdc, usdz, json, glb, vrma, npz, arrow, msgpack have them")
    for other in ("usdc", "glb", "json", "npz"):
        assert warnings(face("GET", f"/v1/models/face/clip.{other}?{QUERY}")) == []
    # A model without curves has none to leave out.
    assert warnings(ask("GET", "/v1/models/reach/clip.bvh")) == []
