"""A quadruped through the whole product: trained and served by the commands, and in every file."""

import json
import struct
import subprocess
from urllib.request import urlopen

import numpy as np
import pytest
from families import quadruped_walk
from serving import POSEFIELD, address, process

pytestmark = pytest.mark.system

JOINTS = 19
MODEL = "v1/models/quadruped"
QUESTION = "speed=0.9&turn=0"


@pytest.fixture(scope="module")
def service(tmp_path_factory):
    from posefield_train.sample import sample_files

    folder = tmp_path_factory.mktemp("figures")
    recipe = sample_files.write_folder(folder / "quadruped", quadruped_walk.files())
    model = folder / "models/quadruped.onnx"
    model.parent.mkdir()
    subprocess.run([POSEFIELD, "train", recipe, "-o", model], capture_output=True, check=True)
    with process(model.parent) as child:
        yield address(child)


@pytest.fixture
def ask(service):
    def of(path):
        with urlopen(f"{service}/{path}", timeout=120) as answer:
            return answer.read()

    return of


def test_the_card_shows_the_figure(ask):
    card = json.loads(ask(MODEL))
    assert (len(card["skeleton"]["names"]), len(card["feet"])) == (JOINTS, 4)


@pytest.mark.parametrize(("extension", "body"), [("usda", "bones"), ("usdc", "none")])
def test_usd_has_the_joints_and_the_motion(ask, tmp_path, extension, body):
    from pxr import Usd, UsdSkel

    path = tmp_path / f"clip.{extension}"
    path.write_bytes(ask(f"{MODEL}/clip.{extension}?{QUESTION}&body={body}"))
    stage = Usd.Stage.Open(str(path))
    animations = [prim for prim in stage.Traverse() if prim.IsA(UsdSkel.Animation)]
    (animation,) = map(UsdSkel.Animation, animations)
    assert len(animation.GetJointsAttr().Get()) == JOINTS
    times = animation.GetRotationsAttr().GetTimeSamples()
    first, last = (np.array(animation.GetTranslationsAttr().Get(t)) for t in (times[0], times[-1]))
    assert len(times) > 10 and np.abs(last[0] - first[0]).max() > 0.1


def test_gltf_has_the_joints_and_the_motion(ask):
    content = ask(f"{MODEL}/clip.glb?{QUESTION}&body=bones")
    size = struct.unpack("<I", content[12:16])[0]
    document = json.loads(content[20 : 20 + size])
    assert len(document["skins"][0]["joints"]) == JOINTS
    assert len(document["animations"][0]["channels"]) >= JOINTS


def test_it_walks_in_a_loop_and_in_a_crowd(ask, tmp_path):
    from pxr import Usd

    trust = json.loads(ask(f"{MODEL}/clip.json?{QUESTION}"))["trust"]
    assert trust["supported"] and trust["measured"]["speed"] == pytest.approx(0.9, rel=1e-4)
    path = tmp_path / "herd.usdc"
    path.write_bytes(ask(f"{MODEL}/crowd.usdc?count=12&seconds=2&seed=1"))
    assert len(list(Usd.Stage.Open(str(path)).Traverse())) > 12
