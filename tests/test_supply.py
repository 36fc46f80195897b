"""Tests of the list of the image's packages: it equals the installed packages."""

import json
import re
import shlex
import subprocess
import sys
from importlib.metadata import distribution
from pathlib import Path

import pytest

pytestmark = pytest.mark.system

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def lister():
    """The command of the Dockerfile that lists what is installed, for some interpreter."""
    text = (ROOT / "Dockerfile").read_text()
    (command,) = re.findall(r"cyclonedx-py (environment .*) --output-file \S+sbom.cdx.json", text)
    tool = Path(sys.executable).with_name("cyclonedx-py")

    def listed(python):
        whole = [tool, *shlex.split(command), python]
        return subprocess.run(whole, cwd=ROOT, capture_output=True, check=True).stdout

    return listed


def named(content):
    """Names and versions of a list's components."""
    document = json.loads(content)
    return {(canonical(c["name"]), c["version"]) for c in document["components"]}


def canonical(name):
    return re.sub(r"[-_.]+", "-", name).lower()


@pytest.fixture
def environment(tmp_path):
    """Make an environment in which some of what is installed here is."""

    def made(*names):
        root = tmp_path / "env"
        subprocess.run([sys.executable, "-m", "venv", "--without-pip", root], check=True)
        (packages,) = root.glob("lib/*/site-packages")
        for name in names:
            own = distribution(name)
            told = next(file for file in own.files if file.name == "METADATA").parent
            (packages / told).symlink_to(own.locate_file(told))
        return root / "bin/python"

    return made


def test_the_list_is_what_is_installed_and_nothing_else(lister, environment):
    names = ("numpy", "starlette", "uvicorn", "PyYAML", "usd-core")
    python = environment(*names)
    content = lister(python)
    assert named(content) == {(canonical(n), distribution(n).version) for n in names}
    whole = json.loads(content)
    assert (whole["bomFormat"], whole["metadata"]["component"]["name"]) == (
        "CycloneDX",
        "posefield",
    )
    assert content == lister(python)
