"""Tests of sweeps over recipes: equal models in one process, several processes and a cluster."""

import json
import re
import subprocess
import sys

import numpy as np
import pytest
from clusters import started
from minimal import TOML, small_clip, write_clips

pytestmark = pytest.mark.system

MAIN = "from posefield.cli import main; main()"
FRAMES = (12, 16, 20)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Small clips, and recipes of them that differ in their frames."""
    rng = np.random.Generator(np.random.PCG64(3))
    clips = [small_clip(0.4 * i + 0.02 * rng.standard_normal(), 21 + i) for i in range(6)]
    path = write_clips(tmp_path_factory.mktemp("sweep") / "small", clips)
    for frames in FRAMES:
        text = TOML.replace("frames = 20", f"frames = {frames}")
        (path / f"at_{frames}.toml").write_text(text)
    return path


def train(*words):
    own = [sys.executable, "-c", MAIN, "train", *map(str, words)]
    return subprocess.run(own, capture_output=True, text=True, check=False)


def recipes(folder):
    return [folder / f"at_{frames}.toml" for frames in FRAMES]


def contents(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@pytest.fixture(scope="module")
def alone(folder, tmp_path_factory):
    """Content of each model, trained by itself."""
    made = tmp_path_factory.mktemp("alone")
    for path in recipes(folder):
        done = train(path, "-o", made / f"{path.stem}.onnx")
        assert done.returncode == 0, done.stderr
    found = contents(made)
    # Negative control: they can be told apart.
    assert len(set(found.values())) == len(FRAMES)
    return found


def test_processes_train_the_same_models(folder, alone, tmp_path):
    done = train(*recipes(folder), "-o", tmp_path / "made", "--jobs", 2, "--json")
    assert done.returncode == 0, done.stderr
    assert contents(tmp_path / "made") == alone
    facts = json.loads(done.stdout)
    assert [one["file"] for one in facts] == [f"{tmp_path}/made/{name}" for name in sorted(alone)]


def test_a_cluster_trains_the_same_models(folder, alone, tmp_path):
    with started(tmp_path, 2) as cluster:
        words = ("-o", tmp_path / "made", "--scheduler", cluster.address)
        done = train(*recipes(folder), *words)
    assert done.returncode == 0, done.stderr
    assert contents(tmp_path / "made") == alone
    assert done.stdout.count("onnxruntime differs from the reference") == len(FRAMES)


def test_a_cluster_computes_the_parts_of_one_training(folder, alone, tmp_path):
    own, path = recipes(folder)[0], tmp_path / "one.onnx"
    with started(tmp_path, 2) as cluster:
        done = train(own, "-o", path, "--scheduler", cluster.address)
    assert done.returncode == 0, done.stderr
    assert path.read_bytes() == alone[f"{own.stem}.onnx"]


def test_a_recipe_that_makes_no_model_stops_no_other(folder, alone, tmp_path):
    few = folder / "few.toml"
    few.write_text(TOML + "[clips.where]\nv = { maximum = 0 }\n")
    done = train(few, *recipes(folder), "-o", tmp_path / "made")
    assert done.returncode == 4
    assert re.search(r"^few: 1 samples, expected at least 2", done.stderr, re.MULTILINE)
    assert done.stderr.endswith("posefield: few of 4 made no model\n")
    assert contents(tmp_path / "made") == alone


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("-o", "made.onnx"), "output: 'made.onnx', expected a folder for several models"),
        (("-o", "made", "--resume", "kept"), "resume: of several recipes, expected none"),
        (("-o", "made", "--jobs", "0"), "jobs: 0, expected 1 or more"),
    ],
)
def test_what_cannot_be_is_refused_first(folder, words, said):
    done = train(*recipes(folder), *words)
    assert (done.returncode, said in done.stderr) == (2, True), done.stderr


def test_two_of_one_name_are_refused(folder, tmp_path):
    done = train(*recipes(folder), folder / "at_12.toml", "-o", tmp_path / "made")
    assert done.returncode == 2
    assert "RECIPE: at_12 twice, expected names of their own" in done.stderr
    assert not (tmp_path / "made").exists()
