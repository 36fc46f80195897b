"""Tests of `import posefield`: without a server it gives the bytes of the service's answers."""

import subprocess
import sys

import numpy as np
import orjson
import pytest
from asking import asker

import posefield
from posefield.encode.formats import POSE_ENCODERS
from posefield.http.api.settings import Settings
from posefield.http.app import create_app
from posefield.registry.model_registry import ModelRegistry

SCRIPT = {
    "segments": [{"kind": "walk", "model": "cmu_walk", "to": [0.0, 2.0]}],
    "unit": "cm",
    "body": "none",
}


@pytest.fixture(scope="module")
def reaching(model_path):
    return posefield.load(model_path)


@pytest.fixture(scope="module")
def walk():
    return posefield.load("cmu_walk")


@pytest.fixture(scope="module")
def ask(reaching, walk):
    models = {model.synthesizer.name: model.synthesizer for model in (reaching, walk)}
    send = asker(create_app(ModelRegistry(models), Settings()))

    def content(method, url, **body):
        answer = send(method, f"/v1/{url}", **body)
        assert answer.status_code == 200, answer.text
        return answer.content

    return content


def test_poses_are_those_of_the_service(reaching, ask):
    times = np.array([0.0, 0.25])
    answer = reaching.pose(times, stature=np.float64(1.7), controls={"turn": 20}, joint_sigma=True)
    query = "stature=1.7&turn=20&time=0&time=0.25&joint_sigma=true"
    assert POSE_ENCODERS["json"].encode(answer) == ask("GET", f"models/reaching/pose?{query}")
    assert answer.rotations.shape == (2, len(answer.bone_offsets), 4) and answer.trust.joint_sigma
    assert np.array_equal(reaching.pose(0.25, stature=1.7).times, [0.25])


@pytest.mark.parametrize(
    ("extension", "conventions", "query"),
    [
        ("usdc", {"unit": "cm", "up": "z"}, "&unit=cm&up=z"),
        ("glb", {"body": "bones"}, "&body=bones"),
    ],
)
def test_clips_are_saved_as_the_service_sends_them(
    walk, ask, tmp_path, extension, conventions, query
):
    clip = walk.clip(speed=1.3, fps=60, names="ue5")
    path = tmp_path / f"walk.{extension}"
    assert clip.save(path, **conventions) == clip.trust.warnings
    address = f"models/cmu_walk/clip.{extension}?speed=1.3&fps=60&names=ue5{query}"
    assert path.read_bytes() == ask("GET", address)


def test_crowds_and_performances_are_saved_as_the_service_sends_them(walk, ask, tmp_path):
    crowd = walk.crowd(count=3, seconds=1.0, seed=4)
    assert crowd.save(tmp_path / "crowd.usdc")["feet_stand"] is True
    address = "models/cmu_walk/crowd.usdc?count=3&seconds=1&seed=4"
    assert (tmp_path / "crowd.usdc").read_bytes() == ask("GET", address)
    crowd.save(tmp_path / "crowd.npz")
    performance = walk.perform(SCRIPT)
    performance.save(tmp_path / "performance.usda", layout="segments")
    content = ask("POST", "performances.usda?layout=segments", json=SCRIPT)
    assert (tmp_path / "performance.usda").read_bytes() == content
    (tmp_path / "script.json").write_bytes(orjson.dumps(SCRIPT))
    again = posefield.perform(tmp_path / "script.json")
    assert np.array_equal(again.clip.rotations, performance.clip.rotations)


def test_errors_name_the_field(walk, tmp_path):
    for call, text in (
        (lambda: posefield.load("cmu_wal"), "did you mean 'cmu_walk'"),
        (lambda: posefield.load(tmp_path), "a folder, expected one .onnx file"),
        (lambda: walk.clip(sped=1.3), "controls/sped: no such control"),
        (lambda: walk.clip(fps="fast"), "fps: Expected `float`"),
        (lambda: walk.pose(-1.0), "times"),
        (lambda: walk.clip().save(tmp_path / "walk.fbx"), "output: 'walk.fbx' ends in none of"),
        (lambda: walk.clip().save(tmp_path / "walk.bvh", body="bones"), "body"),
        (lambda: walk.crowd(count=0, seconds=1.0).save(tmp_path / "c.usdc"), "count"),
        (lambda: walk.crowd(count=1, seconds=1.0).save(tmp_path / "c.glb"), "output"),
        (lambda: walk.perform({"segments": [{"kind": "act", "model": "x"}]}), "segments/0/model"),
        (lambda: posefield.perform(tmp_path / "none.json"), "expected a script in JSON"),
    ):
        with pytest.raises(posefield.MotionError, match=text):
            call()
    with pytest.raises(AttributeError, match="no attribute 'open'"):
        posefield.open  # noqa: B018


def test_the_import_is_light():
    code = "import posefield, sys; print({'numpy', 'onnxruntime', 'msgspec'} & sys.modules.keys())"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "set()\n"
