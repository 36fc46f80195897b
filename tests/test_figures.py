"""A quadruped and a hand through the whole product: sampled, trained, served, and in every file."""

import json
import struct
import subprocess
from urllib.request import urlopen

import numpy as np
import pytest
from serving import POSEFIELD, address, process

pytestmark = pytest.mark.system

JOINTS = {"quadruped": 19, "hand": 16}
QUESTIONS = {"quadruped": "speed=0.9&turn=0", "hand": "width=0.045&lift=1.0"}


def posefield(*words):
    done = subprocess.run([POSEFIELD, *map(str, words)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done


@pytest.fixture(scope="module")
def models(tmp_path_factory):
    folder = tmp_path_factory.mktemp("figures")
    (folder / "models").mkdir()
    for name in JOINTS:
        posefield("sample", name, "-o", folder / name)
        posefield("train", folder / name / "recipe.toml", "-o", folder / f"models/{name}.onnx")
    return folder / "models"


@pytest.fixture(scope="module")
def service(models):
    with process(models) as child:
        yield address(child)


@pytest.fixture
def ask(service):
    def of(path):
        with urlopen(f"{service}/{path}", timeout=120) as answer:
            return answer.read()

    return of


@pytest.mark.parametrize("name", JOINTS)
def test_the_card_and_the_page_show_the_figure(ask, name):
    card = json.loads(ask(f"v1/models/{name}"))
    assert len(card["skeleton"]["names"]) == JOINTS[name]
    assert len(card["feet"]) == (4 if name == "quadruped" else 0)
    assert b"<html" in ask("")


@pytest.mark.parametrize("name", JOINTS)
@pytest.mark.parametrize("extension", ["usda", "usdc", "usdz"])
@pytest.mark.parametrize("body", ["none", "bones"])
def test_usd_has_the_joints_and_the_motion(ask, tmp_path, name, extension, body):
    from pxr import Usd, UsdSkel

    path = tmp_path / f"clip.{extension}"
    path.write_bytes(ask(f"v1/models/{name}/clip.{extension}?{QUESTIONS[name]}&body={body}"))
    stage = Usd.Stage.Open(str(path))
    found = [prim for prim in stage.Traverse() if prim.IsA(UsdSkel.Animation)]
    (animation,) = map(UsdSkel.Animation, found)
    assert len(animation.GetJointsAttr().Get()) == JOINTS[name]
    times = animation.GetRotationsAttr().GetTimeSamples()
    first, last = (np.array(animation.GetTranslationsAttr().Get(t)) for t in (times[0], times[-1]))
    assert len(times) > 10 and np.abs(last[0] - first[0]).max() > 0.1


@pytest.mark.parametrize("name", JOINTS)
def test_gltf_has_the_joints_and_the_motion(ask, name):
    content = ask(f"v1/models/{name}/clip.glb?{QUESTIONS[name]}&body=bones")
    size = struct.unpack("<I", content[12:16])[0]
    document = json.loads(content[20 : 20 + size])
    assert len(document["skins"][0]["joints"]) == JOINTS[name]
    assert len(document["animations"][0]["channels"]) >= JOINTS[name]


def test_the_quadruped_walks_in_a_loop_and_in_a_crowd(ask, tmp_path):
    from pxr import Usd

    answer = json.loads(ask("v1/models/quadruped/clip.json?speed=0.9&turn=0"))
    assert answer["trust"]["supported"] and answer["trust"]["measured"]["speed"] == pytest.approx(
        0.9
    )
    path = tmp_path / "herd.usdc"
    path.write_bytes(ask("v1/models/quadruped/crowd.usdc?count=12&seconds=2&seed=1"))
    assert len(list(Usd.Stage.Open(str(path)).Traverse())) > 12
