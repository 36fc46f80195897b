"""Tests of the documentation's examples: they run against the shipped models."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import document_pages
import pytest
import serving

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


def examples(path):
    found = document_pages.blocks(path.read_text())
    return [block for block in found if block.language in RUNNING]


def run(block, address, folder):
    """Run an example in a folder; return its exit code and what it says."""
    text = block.text.replace(ADDRESS, address)
    strict = "" if REFUSED in text else STRICT
    command = ["bash", "-euo", "pipefail", "-c", strict + text]
    if block.language == "python":
        command = [sys.executable, "-c", text]
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    environ = {**os.environ, "PATH": path, "NO_PROXY": "127.0.0.1"}
    done = subprocess.run(
        command, cwd=folder, env=environ, capture_output=True, text=True, timeout=LONGEST
    )
    return done.returncode, done.stdout + done.stderr


def assert_runs(block, address, folder):
    code, said = run(block, address, folder)
    assert code == 0, f"{block.text}\n{said}"
    for line in block.text.splitlines():
        if line.startswith(REFUSED):
            assert '"status":422' in said and line.removeprefix(REFUSED) in said


@pytest.mark.parametrize(
    "path",
    [path for path in document_pages.pages() if examples(path)],
    ids=document_pages.identifier,
)
def test_the_examples_of_a_page_run_in_order(path, shipped_address, folder):
    for block in examples(path):
        assert_runs(block, shipped_address, folder)


def test_many_examples_are_found():
    """Negative control of the test above."""
    found = [block for path in document_pages.pages() for block in examples(path)]
    assert len(found) > 25 and {block.language for block in found} == set(RUNNING)


@pytest.mark.parametrize(
    "text",
    [
        f"curl 'http://{ADDRESS}/v1/models/reaching/pose?tune=1&time=0'\n",
        "posefield clip models/none.onnx -o none.usdc\n",
        "false | true\n",
    ],
)
def test_an_example_that_fails_is_found(text, shipped_address, folder):
    """Negative control: unknown controls, files and failures within a pipe."""
    assert run(document_pages.Block("sh", text), shipped_address, folder)[0] != 0
