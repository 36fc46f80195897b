"""Tests of the archive that Blender installs, and of the add-on's sources."""

import ast
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import archive
import pytest

ROOT = Path(__file__).parents[3]
ADDON = ROOT / "clients/blender/addon"
STANDARD = sys.stdlib_module_names | {"numpy"}


def manifest():
    return tomllib.loads((ADDON / "blender_manifest.toml").read_text())


def test_the_same_files_give_the_same_bytes(tmp_path):
    here = archive.build(tmp_path / "here")
    command = [sys.executable, archive.__file__, tmp_path / "there"]
    said = subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()
    assert Path(said).read_bytes() == here.read_bytes()
    assert here.name == f"posefield-blender-{manifest()['version']}.zip"


def test_it_holds_the_add_on_and_nothing_else(tmp_path):
    with zipfile.ZipFile(archive.build(tmp_path)) as opened:
        names = opened.namelist()
        assert opened.read("LICENSE") == (ROOT / "LICENSE").read_bytes()
    assert {"__init__.py", "blender_manifest.toml", "without_blender/card.py"} < set(names)
    assert all(name.endswith(".py") for name in set(names) - {"LICENSE", "blender_manifest.toml"})
    assert not any("__pycache__" in name for name in names)


def test_the_manifest_says_what_blender_must_know():
    found = manifest()
    assert (found["id"], found["type"]) == ("posefield", "add-on")
    assert found["blender_version_min"] == "4.5.0"
    assert found["license"] == ["SPDX:Apache-2.0"]
    assert set(found["permissions"]) == {"network"}
    assert len(found["tagline"]) <= 64
    assert not found["tagline"].endswith(".")


def test_the_readme_names_the_archive_that_is_made():
    text = (ADDON.parent / "README.md").read_text()
    assert f"build/posefield-blender-{manifest()['version']}.zip" in text


def imports(file):
    """Modules that a file imports from outside its package."""
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.Import):
            yield from (name.name.partition(".")[0] for name in node.names)
        if isinstance(node, ast.ImportFrom) and not node.level:
            yield node.module.partition(".")[0]


@pytest.mark.parametrize("file", sorted(ADDON.rglob("*.py")), ids=lambda file: file.name)
def test_it_needs_nothing_but_blender(file):
    needed = set(imports(file)) - STANDARD
    assert needed <= (set() if file.parent.name == "without_blender" else {"bpy"})


def test_the_check_sees_what_is_imported():
    assert "bpy" in set(imports(ADDON / "scene.py"))
