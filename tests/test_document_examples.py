"""Tests of the documentation's examples: they run against the shipped models.

The packages are installed from their wheels, in an environment that holds nothing else.
"""

import os
import shutil
import subprocess
import sys

import document_pages
import pytest
import serving
import wheels

pytestmark = pytest.mark.system

ADDRESS = "127.0.0.1:8000"
SHIPPED = document_pages.ROOT / "service/posefield/shipped"
# Requests fail for other statuses than those of success; the body is shown.
STRICT = 'curl() { command curl --silent --show-error --fail-with-body "$@"; }\n'
REFUSED = "# 422: "
"""Begins a comment of an example whose request is refused, with a part of the answer."""
RUNNING = ("sh", "python")
LONGEST = 300


@pytest.fixture(scope="module")
def shipped_address():
    """Yield host and port of a service with the shipped models."""
    with serving.process(SHIPPED) as child:
        yield serving.address(child).removeprefix("http://")


@pytest.fixture
def folder(tmp_path):
    """Return a folder with the shipped models in `models`, as the examples expect it."""
    (tmp_path / "models").mkdir()
    for file in SHIPPED.glob("*.onnx"):
        shutil.copy(file, tmp_path / "models")
    return tmp_path


@pytest.fixture(scope="module")
def programs(dist, tmp_path_factory):
    """Return the folder of programs of an environment with the packages that the pages install."""
    packages = ("posefield[evaluate,parquet]", "posefield-client")
    return wheels.install(dist, tmp_path_factory.mktemp("env"), sys.executable, *packages)


def examples(path):
    return [block for block in document_pages.blocks(path.read_text()) if block.language in RUNNING]


def run(block, address, folder, programs):
    """Run an example in a folder; return its exit code and its output."""
    text = block.text.replace(ADDRESS, address)
    strict = "" if REFUSED in text else STRICT
    command = ["bash", "-euo", "pipefail", "-c", strict + text]
    if block.language == "python":
        command = [programs / "python", "-c", text]
    path = f"{programs}{os.pathsep}{os.environ['PATH']}"
    environ = {**os.environ, "PATH": path, "NO_PROXY": "127.0.0.1"}
    done = subprocess.run(
        command, cwd=folder, env=environ, capture_output=True, text=True, timeout=LONGEST
    )
    return done.returncode, done.stdout + done.stderr


def assert_runs(path, address, folder, programs):
    for block in examples(path):
        code, output = run(block, address, folder, programs)
        assert code == 0, f"{block.text}\n{output}"
        for line in block.text.splitlines():
            if line.startswith(REFUSED):
                assert '"status":422' in output and line.removeprefix(REFUSED) in output


@pytest.mark.parametrize(
    "path",
    [path for path in document_pages.pages() if examples(path)],
    ids=document_pages.identifier,
)
def test_the_examples_of_a_page_run_in_order(path, shipped_address, folder, programs):
    assert_runs(path, shipped_address, folder, programs)


# `.ci/pythons` makes an environment for each Python of this machine.
PYTHONS = {path.parent.name[-4:]: path for path in wheels.ROOT.glob(".venv-3.*/bin/")}


@pytest.mark.parametrize("version", ["3.11", "3.12", "3.13"])
def test_a_newcomers_pages_run_under_each_python(version, dist, shipped_address, folder, tmp_path):
    """With the packages that these pages name, and no extra."""
    if version not in PYTHONS or version == "{}.{}".format(*sys.version_info):
        pytest.skip(f"tried above, or no environment of .ci/pythons with Python {version}")
    packages = ("posefield[train]", "posefield-client")
    programs = wheels.install(dist, tmp_path, PYTHONS[version] / "python", *packages)
    for page in ("README.md", "docs/quickstart.md"):
        assert_runs(wheels.ROOT / page, shipped_address, folder, programs)


def test_many_examples_are_found():
    """Negative control of the test above."""
    found = [block for path in document_pages.pages() for block in examples(path)]
    assert len(found) > 25 and {block.language for block in found} == set(RUNNING)


@pytest.mark.parametrize(
    "text",
    [
        f"curl 'http://{ADDRESS}/v1/models/cmu_walk/pose?sped=1&time=0'\n",
        "posefield clip models/none.onnx -o none.usdc\n",
        "false | true\n",
    ],
)
def test_an_example_that_fails_is_found(text, shipped_address, folder, programs):
    """Negative control: unknown controls, files and failures within a pipe."""
    assert run(document_pages.Block("sh", text), shipped_address, folder, programs)[0] != 0
