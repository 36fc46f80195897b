"""Tests of the shipped models: their card, notice and listing, and that the recipes make them."""

import hashlib
import json
import re
from pathlib import Path

import httpx
import numpy as np
import pytest
import serving

from posefield.inference import session
from posefield.model_file import checked_file
from posefield.question.motion_question import ClipQuestion
from posefield.registry import model_registry
from posefield.synthesis import clips
from posefield.synthesis.synthesizer import Synthesizer
from posefield_train.source import data_folder, recipe

NAMES = (
    *("cmu_walk", "hdm05_deposit_floor", "hdm05_deposit_return", "hdm05_grab_high"),
    *("hdm05_grab_return", "hdm05_hop", "hdm05_kick", "hdm05_kick_return", "hdm05_sneak"),
    "hdm05_squat",
)
# Licences that forbid to sell a product, or to adapt the motion.
BINDING = re.compile(r"\b(NC|ND)\b|non-?commercial|no-?derivatives|Bandai", re.IGNORECASE)
SAME = 1e-5
"""Bound, m, of the difference between answers of a shipped model and of one trained again."""


def file(name):
    return model_registry.SHIPPED_FOLDER / f"{name}.onnx"


@pytest.fixture(scope="module")
def cards():
    return {name: checked_file.load_card(file(name).read_bytes(), name) for name in NAMES}


def test_the_walk_ships_first_and_is_small():
    found = sorted(path.name for path in model_registry.SHIPPED_FOLDER.glob("*.onnx"))
    assert found == [f"{name}.onnx" for name in NAMES]
    assert all(file(name).stat().st_size < 150_000 for name in NAMES)


def test_the_notice_quotes_the_licence_of_every_model(cards):
    notice = " ".join(model_registry.NOTICE.read_text().split())
    assert cards["cmu_walk"].provenance["licence"].startswith("Free for all uses, not to be resold")
    for name in NAMES:
        licence = cards[name].provenance["licence"]
        assert f"{name}.onnx" in notice
        assert not BINDING.search(licence)
        assert licence.startswith("CC BY-SA 3.0: ") == name.startswith("hdm05_")
        source = "HDM05 (" if name.startswith("hdm05_") else "mocap.cs.cmu.edu"
        assert f"the data used in this project was obtained from {source}" in licence
    assert "The data used in this project was obtained from mocap.cs.cmu.edu" in notice
    assert "NSF EIA-0196217" in notice and "NSF EIA-0196217" in str(cards["cmu_walk"].provenance)
    assert '"The data used in this project was obtained from HDM05."' in notice
    assert "CC BY-SA 3.0" in notice and "https://creativecommons.org/licenses/by-sa/3.0/" in notice
    assert BINDING.search("CC BY-NC 4.0"), "negative control"


def test_models_lists_the_shipped_models(posefield, cards):
    code, out, err = posefield("models")
    heading, *lines, last = out.splitlines()
    assert (code, err) == (0, "")
    assert heading.split() == "name controls clips performers size file licence".split()
    assert [line.split()[0] for line in lines] == list(NAMES)
    assert re.search(
        r"speed, turn, stride_length +78 +15 +1[23]\d kB .*mocap\.cs\.cmu\.edu", lines[0]
    )
    assert last.endswith(str(model_registry.NOTICE))


def test_models_lists_local_models_as_json(posefield, model_path):
    code, out, err = posefield("models", model_path, "--json")
    *shipped, own = json.loads(out)
    assert (code, err) == (0, "")
    assert [one["name"] for one in shipped] == list(NAMES)
    assert (own["file"], own["bytes"]) == (str(model_path), model_path.stat().st_size)
    assert own["identity"] == f"reaching@{checked_file.digest(model_path.read_bytes())}"
    speed = shipped[0]["controls"][0]
    assert (speed["name"], speed["unit"]) == ("speed", "m/s")
    assert speed["minimum"] < 0.5 and speed["maximum"] > 1.7
    assert len(shipped[0]["performers"]) == 15


def test_models_names_a_file_that_is_none_and_lists_the_others(posefield, tmp_path):
    (tmp_path / "broken.onnx").write_bytes(b"no model")
    code, out, err = posefield("models", tmp_path, tmp_path / "none")
    assert code == 3
    assert [line.split()[0] for line in out.splitlines()[1:-1]] == list(NAMES)
    assert [line.split(": ")[1] for line in err.splitlines()] == [
        str(tmp_path / "broken.onnx"),
        str(tmp_path / "none"),
    ]


def answers(model):
    """Joint positions (points, times, J, 3), m, at corners of the controls' ranges and amid."""
    card = model.session.card
    found = []
    for share in (0.1, 0.5, 0.9):
        controls = {c.name: c.minimum + share * (c.maximum - c.minimum) for c in card.controls}
        asked = ClipQuestion(controls=controls, fps=30.0, extrapolate="ok")
        found.append(clips.synthesize_clip(model, asked).clip.positions()[[0, 9, 18]])
    return np.stack(found)


def open_model(name, content):
    return Synthesizer(name, session.load_bytes(content, f"{name}.onnx"))


def assert_trained_again(name, content):
    """Assert that a file just trained gives the answers of the shipped one.

    Bytes are compared by their origins only: another BLAS rounds otherwise, and the card names the
    versions of the libraries.
    """
    shipped = open_model(name, file(name).read_bytes())
    again = open_model(name, content)
    for key in ("data_sha256", "recipe_sha256", "clips", "licence"):
        assert shipped.session.card.provenance[key] == again.session.card.provenance[key]
    apart = np.abs(answers(shipped) - answers(again))
    assert apart.max() < SAME
    shifted = np.abs(answers(shipped) - np.roll(answers(again), 1, axis=0))
    assert shifted.max() > 1000 * SAME, "negative control: other controls, other motion"


def test_the_walk_is_what_its_recipe_makes(real_data, posefield, tmp_path):
    made = tmp_path / "cmu_walk.onnx"
    code, _, err = posefield("train", "cmu_walk", "--data", real_data, "-o", made)
    assert code == 0, err
    assert_trained_again("cmu_walk", made.read_bytes())


@pytest.mark.system
@pytest.mark.parametrize("name", [name for name in NAMES if name != "cmu_walk"])
def test_an_act_is_what_its_recipe_makes(name, real_data, models_trained):
    assert_trained_again(name, models_trained.captured(name, real_data)[2].content)


@pytest.mark.parametrize("name", NAMES)
def test_the_model_is_that_of_its_recipe(name, cards):
    """A recipe that has changed since: make shipped-models."""
    own = recipe.read(data_folder.RECIPES / f"{name}.toml").model_dump_json()
    assert cards[name].provenance["recipe_sha256"] == hashlib.sha256(own.encode()).hexdigest()


def test_scripts_open_the_models_that_they_name_alone():
    model_registry.shipped_model.cache_clear()
    found = model_registry.with_shipped([])
    assert tuple(found.models) == NAMES
    assert model_registry.shipped_model.cache_info().currsize == 0
    walk = found.find("cmu_walk")
    assert found.find(walk.identity) is walk
    assert model_registry.shipped_model.cache_info().currsize == 1


@pytest.mark.system
def test_serve_without_places_serves_the_shipped_models():
    with serving.process() as child:
        url = serving.address(child)
        listed = httpx.get(f"{url}/v1/models").json()["models"]
        assert [model["name"] for model in listed] == list(NAMES)
        crowd = httpx.get(f"{url}/v1/models/cmu_walk/crowd.usdc?count=2&seconds=1")
        assert crowd.content.startswith(b"PXR-USDC")


def test_the_makefile_and_the_guide_name_the_models():
    root = Path(__file__).parents[1]
    listed = re.search(r"SHIPPED_FAMILIES := ((.*\\\n)*.*)\n", (root / "Makefile").read_text())[1]
    assert tuple(listed.replace("\\", "").split()) == NAMES
    page = (root / "docs/guide/shipped-models.md").read_text()
    assert tuple(re.findall(r"^\| `(\w+)` \|", page, re.MULTILINE)) == NAMES
