"""A running service for the TypeScript client, and Node as the project's own environment has it."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
# Starting a real service is written once, beside the contract's tests.
sys.path.append(str(ROOT / "tests/contract"))

from serving import address, process  # noqa: E402

BIN = Path(sys.executable).parent


@pytest.fixture(scope="session")
def url(labelled_path, walk_path, tmp_path_factory):
    """Where a service listens that has the models of api/examples."""
    folder = tmp_path_factory.mktemp("models")
    shutil.copy(labelled_path, folder / "reach.onnx")
    shutil.copy(walk_path, folder / "walk.onnx")
    with process(folder) as child:
        yield address(child)


@pytest.fixture(scope="session")
def expect_success():
    """Function that runs a command in clients/typescript and fails with what it prints."""

    def run(*words, **environ):
        path = f"{BIN}{os.pathsep}{os.environ['PATH']}"
        given = {**os.environ, "PATH": path, **environ}
        package = ROOT / "clients/typescript"
        done = subprocess.run(words, cwd=package, env=given, capture_output=True, text=True)
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    return run
