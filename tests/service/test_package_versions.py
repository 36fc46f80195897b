"""Tests of the versions of packages on which results depend."""

import re
import sys
from importlib.metadata import PackageNotFoundError, requires, version
from pathlib import Path

import pytest
from packaging.requirements import Requirement

from posefield.common.package_versions import SAME_MODULE, package_version
from posefield.http.middleware import caching

ROOT = Path(__file__).parents[2]


@pytest.fixture
def only(tmp_path, monkeypatch):
    """Let nothing be installed but packages of these names and versions."""

    def installed(**versions):
        for name, number in versions.items():
            folder = tmp_path / f"{name}-{number}.dist-info"
            folder.mkdir()
            (folder / "METADATA").write_text(f"Name: {name}\nVersion: {number}\n")
        monkeypatch.setattr(sys, "path", [str(tmp_path)])

    return installed


def test_an_installed_package_has_its_own_version():
    assert package_version("numpy") == version("numpy")


def test_a_package_with_the_same_module_takes_its_place(only):
    only(onnxruntime_gpu="9.8")
    assert package_version("onnxruntime") == "9.8"
    with pytest.raises(PackageNotFoundError):
        package_version("numpy")


def test_the_package_itself_wins(only):
    only(onnxruntime_gpu="9.8", onnxruntime="1.2")
    assert package_version("onnxruntime") == "1.2"


def test_without_either_there_is_no_version(only):
    only()
    with pytest.raises(PackageNotFoundError):
        package_version("onnxruntime")


def test_entity_tags_do_not_need_the_package_of_the_cpu(only):
    here = caching.code_digest()
    found = {name.replace("-", "_"): version(name) for name in caching.LIBRARIES}
    only(**found | {"onnxruntime_gpu": found.pop("onnxruntime")})
    assert caching.code_digest() == here


def test_the_package_of_the_gpu_replaces_a_required_one():
    """An extra would install both, and whose files win would be left to the installer."""
    needed = [Requirement(line) for line in requires("posefield")]
    plain = {each.name for each in needed if each.marker is None}
    assert SAME_MODULE.keys() <= plain
    assert not {each.name for each in needed} & set(SAME_MODULE.values())


def test_the_documented_lines_replace_the_required_package():
    text = (ROOT / "docs/operate/providers.md").read_text()
    (removed,) = re.findall(r"^pip uninstall --yes (\S+)$", text, re.MULTILINE)
    (line,) = re.findall(r'^pip install "(.+)"$', text, re.MULTILINE)
    added = Requirement(line)
    assert SAME_MODULE[removed] == added.name
    # The version that the lock file names, whose behaviour the records describe, fits both.
    (required,) = (own for own in map(Requirement, requires("posefield")) if own.name == removed)
    assert version(removed) in added.specifier and version(removed) in required.specifier
