"""System test: long takes become families, a person's decisions, models, and clips in Blender."""

import json
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest
import user_rigs
from decided_page import decide

from posefield.inference import session
from posefield_train.families import found_families

pytestmark = pytest.mark.system

ROOT = Path(__file__).parents[1]
BLENDER = ROOT / ".venv-blender/bin/python"
TAKES = {"hdm05_long": "*_0.bvh", "cmu_walk": "p[0134]*_walking_*_t*.bvh"}
"""Takes of each data set that are searched: of each performer the first, and some walks."""
FURTHEST = 1e-4
"""Largest distance of a joint in Blender from its place by UsdSkel, m."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("discovery")


@pytest.fixture
def found(real_data, posefield, folder):
    """Function that searches some takes of a data set once, and returns its folder of recipes."""

    def of(name):
        made = folder / f"{name}_recipes"
        if not made.exists():
            takes = some_takes(real_data, name, folder / name)
            words = ("discover", takes, "-o", made, "--licence", "ours", "--candidates", "300")
            code, _, err = posefield(*words)
            assert code == 0, err
        return made

    return of


def some_takes(real_data, name, target):
    """Copy some motion files of a data set, which is an archive or a folder, into a folder."""
    target.mkdir()
    archive = real_data / f"{name}.zip"
    if archive.exists():
        with zipfile.ZipFile(archive) as content:
            for entry in map(Path, content.namelist()):
                if entry.match(TAKES[name]):
                    (target / entry.name).write_bytes(content.read(entry.as_posix()))
    for path in (real_data / name / "bvh").glob(TAKES[name]):
        shutil.copy(path, target)
    if not any(target.iterdir()):
        pytest.skip(f"no takes of {name} in {real_data}")
    return target


def family_of(made, wanted):
    """The number of the first family that a function of its facts is true of."""
    facts = json.loads((made / "discover.json").read_text())
    return next(one["number"] for one in facts["families"] if wanted(one))


def is_grab(family):
    return family["event"] == ["rightHand", "highest"]


def is_stride(family):
    return family["kind"] == "strides"


CASES = {"hdm05_long": is_grab, "cmu_walk": is_stride}

CLICKS = """
const family = document.querySelector("#family-NUMBER");
family.querySelector("input[value=accept]").click();
family.querySelectorAll("input[name=drop]")[1].click();
const other = document.querySelector("section[data-number]:not(#family-NUMBER)");
other.querySelector("input[value=reject]").click();
"""


@pytest.fixture
def reviewed(posefield, found, folder):
    """Function that returns a folder after the decisions of its page, and the accepted family."""

    def of(name):
        made, number = found(name), family_of(found(name), CASES[name])
        decided = folder / f"{name}_decided"
        if not decided.exists():
            page = decide(made / "index.html", CLICKS.replace("NUMBER", str(number)), folder)
            shutil.copytree(made, decided)
            (folder / f"{name}.json").write_text(page.saved)
            (folder / f"{name}.txt").write_text("\n".join(page.command))
            words = ("review", decided, "--decisions", folder / f"{name}.json")
            assert posefield(*words)[0] == 0
        return decided, number

    return of


@pytest.mark.parametrize("name", CASES)
def test_the_page_and_its_command_make_the_same_bytes(posefield, found, reviewed, folder, name):
    decided, number = reviewed(name)
    program, *words = (folder / f"{name}.txt").read_text().splitlines()
    assert program == "posefield" and words[:2] == ["review", str(found(name))]
    other = shutil.copytree(found(name), folder / f"{name}_by_command")
    assert posefield("review", other, *words[2:])[0] == 0
    both = [{path.name: path.read_bytes() for path in one.iterdir()} for one in (decided, other)]
    assert both[0] == both[1]
    before = {path.name: path.read_bytes() for path in found(name).iterdir()}
    changed = {key for key in before if before[key] != both[0][key]}
    own = {f"family_{number:02d}.toml", f"family_{number:02d}.csv"}
    assert changed == own | {"discover.json"}
    rows = found_families.read(decided / f"family_{number:02d}.csv")
    assert [row.accepted for row in rows].count(False) == 1


@pytest.fixture
def model(posefield, reviewed, folder):
    """Function that trains the accepted family of a data set once, and returns the model file."""

    def of(name):
        decided, number = reviewed(name)
        path = folder / f"{name}.onnx"
        if not path.exists():
            recipe = decided / f"family_{number:02d}.toml"
            code, _, err = posefield("train", recipe, "--data", folder / name, "-o", path)
            assert code == 0, err
        return path

    return of


def in_blender(files, folder):
    """Names and places (F, J, 3), m, of the joints of each file as Blender reads it."""
    if not BLENDER.exists():
        pytest.skip(f"no Blender in {BLENDER.parents[1]}: see tests/interop/environment.py")
    script = ROOT / "tests/interop/blender_read.py"
    subprocess.run([BLENDER, script, files, folder / "read.npz"], capture_output=True, check=True)
    with np.load(folder / "read.npz") as content:
        found = {key: content[key] for key in content.files}
    kinds = [key.removesuffix("/joints") for key in found if key.endswith("/joints")]
    return {
        key.partition("/")[0]: (list(found[f"{key}/joints"]), found[f"{key}/matrices"][..., :3, 3])
        for key in kinds
    }


def assert_same_motion(path, joints, places):
    """Compare Blender's joints with those that UsdSkel computes, in the order of their names."""
    names = user_rigs.stage_joints(path)
    order = [joints.index(name) for name in names]
    for frame in (0, len(places) // 2, len(places) - 1):
        expected, _ = user_rigs.stage_positions(path, frame)
        assert np.abs(places[frame][order] - expected).max() < FURTHEST
    # Negative control: the motion is more than the tolerance.
    assert np.abs(np.ptp(places, axis=0)).max() > 0.2


@pytest.mark.parametrize("name", CASES)
def test_a_clip_of_an_accepted_family_opens_in_blender(posefield, model, tmp_path, name):
    files = tmp_path / "files"
    files.mkdir()
    code, _, err = posefield("clip", model(name), "-o", files / "own.usdc")
    assert code == 0, err
    assert_same_motion(files / "own.usdc", *in_blender(files, tmp_path)["own.usdc"])


@pytest.mark.parametrize("name", CASES)
def test_the_clip_moves_another_character_in_blender(model, tmp_path, name):
    """The other character has other names, lengths, axes, unit and up axis."""
    files = tmp_path / "files"
    files.mkdir()
    card = session.open_bytes(model(name).read_bytes(), name).card
    user_rigs.usd_rig(files / "hero.usdc", card, scale=1.1)
    command = Path(sys.executable).with_name("posefield")
    words = (command, "clip", model(name), "--character", "hero.usdc", "-o", "other.usdc")
    subprocess.run(words, cwd=files, check=True, capture_output=True)
    joints, places = in_blender(files, tmp_path)["other.usdc"]
    assert_same_motion(files / "other.usdc", joints, places)
    assert "mixamorig_Hips" in joints and "mixamorig_Hips" not in card.skeleton.names
