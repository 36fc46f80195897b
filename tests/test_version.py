"""The version of the project: all files that give it agree, and the changelog has its section."""

import json
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest
import yaml

from posefield import __version__

ROOT = Path(__file__).parents[1]
PROJECTS = ("service", "model_export", "clients/python")
PACKAGES = ("page", "runtime", "typescript", "viewer")
PLACES = {
    "CITATION.cff": r"^version: (\S+)$",
    "Dockerfile": r'image\.version="(.+?)"',
    "clients/blender/README.md": r"posefield-blender-(\d.*?)\.zip",
    "clients/blender/addon/blender_manifest.toml": r'^version = "(.+)"$',
    "clients/runtime/README.md": r"posefield-runtime-(\d.*?)\.tgz",
    "clients/typescript/README.md": r"posefield-client-(\d.*?)\.tgz",
    "compose.yaml": r"image: ghcr\.io/posefield/posefield:(\S+)",
    "service/deploy/README.md": r"posefield:(\d[\d.]*\d)",
    "service/deploy/export-job.yaml": r"image: posefield:(\S+)",
    "service/deploy/serve.yaml": r"(?:image: posefield:|/version: )(\S+)",
}
"""Files that give the version in text, and the pattern by which each occurrence is found."""
SECTION = re.compile(r"^## (.+)$", re.MULTILINE)


def test_projects_of_the_workspace_have_the_version_and_require_it_of_each_other():
    assert {_project(folder)["version"] for folder in PROJECTS} == {__version__}
    service, training = _project("service"), _project("model_export")
    extras = [line for extra in service["optional-dependencies"].values() for line in extra]
    lines = [line for line in (*extras, *training["dependencies"]) if "==" in line]
    own = [line for line in lines if line.startswith("posefield")]
    assert len(own) == 4
    assert {line.partition("==")[2] for line in own} == {__version__}


@pytest.mark.parametrize("name", PACKAGES)
def test_packages_of_node_have_the_version(name):
    plain = json.loads((ROOT / "clients" / name / "package.json").read_text())
    locked = json.loads((ROOT / "clients/package-lock.json").read_text())["packages"]
    assert plain["version"] == locked[name]["version"] == __version__
    for described in (plain, locked[name]):
        client = described.get("dependencies", {}).get("@posefield/client", __version__)
        assert client == __version__


@pytest.mark.parametrize("name", PLACES)
def test_other_files_have_the_version(name):
    found = re.findall(PLACES[name], (ROOT / name).read_text(), re.MULTILINE)
    assert found and set(found) == {__version__}


def test_the_changelog_has_the_version_below_what_is_unreleased():
    first, second, *_ = SECTION.findall((ROOT / "CHANGELOG.md").read_text())
    released = yaml.safe_load((ROOT / "CITATION.cff").read_text())["date-released"]
    assert first == "Unreleased"
    assert second == f"{__version__} ({released})"


def test_no_other_file_names_a_version_of_the_image_or_of_an_archive():
    """Completeness of PLACES, by the names that stand before a version."""
    named = re.compile(r"posefield(?::|-blender-|-client-|-runtime-|-train==|==)v?\d+\.\d+\.\d+")
    known = {*PLACES, *(f"{folder}/pyproject.toml" for folder in PROJECTS)}
    # These pages repeat the READMEs of packages.
    known |= {"docs/guide/run-time.md", "docs/reference/typescript.md"}
    found = {name for name, text in _texts() if named.search(text)}
    assert found <= known


def _texts() -> Iterator[tuple[str, str]]:
    """Yield names and contents of documents, manifests and configurations that are not built."""
    for folder in (
        "docs",
        "service/deploy",
        "clients/blender",
        "clients/runtime",
        "clients/typescript",
        ".",
    ):
        within = "*" if folder == "." else "**/*"
        for path in (ROOT / folder).glob(within):
            name = path.relative_to(ROOT)
            # The client's package, where it was built, has a copy of the client's README.
            if "dist" in name.parts:
                continue
            if path.suffix in (".md", ".yaml", ".toml", ".cff") or path.name == "Dockerfile":
                yield name.as_posix(), path.read_text()


def _project(folder: str) -> dict:
    return tomllib.loads((ROOT / folder / "pyproject.toml").read_text())["project"]
