"""Node as the project's own environment has it."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
BIN = Path(sys.executable).parent


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
