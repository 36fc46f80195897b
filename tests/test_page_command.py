"""Tests of `posefield page`: a folder for any static host, with its models."""

import json
import subprocess
import sys
from base64 import b64encode
from hashlib import sha256
from pathlib import Path

import pytest

from posefield.http.static_page import MODEL_PAGE
from posefield.registry.model_registry import SHIPPED_FOLDER

pytestmark = pytest.mark.system
COMMAND = Path(sys.executable).with_name("posefield")


def page(*words):
    words = [COMMAND, "page", *words]
    return subprocess.run(words, capture_output=True, text=True, check=False)


def test_a_page_has_its_models_and_is_written_again_in_its_folder(tmp_path):
    walk = SHIPPED_FOLDER / "cmu_walk.onnx"
    for models in (["hdm05_kick"], [walk, "hdm05_kick"]):
        done = page(*models, "-o", tmp_path / "site", "--json")
        assert done.returncode == 0, done.stderr
    facts = json.loads(done.stdout)
    assert facts["models"] == 2 and facts["bytes"] > 1e6
    entries = json.loads((tmp_path / "site/models.json").read_text())
    assert [entry["name"] for entry in entries] == ["cmu_walk", "hdm05_kick"]
    assert 0.8 < entries[0]["root"][1] < 1.2
    site = tmp_path / "site"
    assert (site / entries[0]["model"]).read_bytes() == walk.read_bytes()
    assert (site / entries[0]["character"]).read_bytes()[:4] == b"glTF"
    digest = b64encode(sha256(walk.read_bytes()).digest()).decode()
    assert entries[0]["integrity"]["model"] == f"sha256-{digest}"
    index = (site / "index.html").read_text()
    assert index == MODEL_PAGE.read_text() and 'src="./assets/' in index


def test_a_folder_of_other_files_is_left_alone(tmp_path):
    (tmp_path / "thesis.txt").write_text("mine")
    done = page("hdm05_kick", "-o", tmp_path)
    assert done.returncode == 3 and "expected a new folder" in done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.txt"]


def test_two_models_of_one_name_are_refused(tmp_path):
    done = page("hdm05_kick", SHIPPED_FOLDER / "hdm05_kick.onnx", "-o", tmp_path / "site")
    assert done.returncode == 2 and "hdm05_kick" in done.stderr
    assert not (tmp_path / "site").exists()
