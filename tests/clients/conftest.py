"""Fixtures of the clients' tests: a service process, and Node from the project's environment."""

import os
import subprocess
import sys
from functools import partial
from pathlib import Path

import pytest
import serving

# Seconds after which nobody waits for a command any more, however busy the machine.
LONGEST = 600

CLIENTS = Path(__file__).parents[2] / "clients"
BIN = Path(sys.executable).parent


@pytest.fixture(scope="module")
def address(models):
    """Yield the address of a service in its own process, with the models of api/examples."""
    with serving.process(models) as child:
        yield serving.address(child)


@pytest.fixture(scope="session")
def in_package():
    """Function from an npm package's name to one that runs a command in it.

    That fails with what the command prints, where it does not succeed.
    """

    def assert_runs(package, *words, **environ):
        path = f"{BIN}{os.pathsep}{os.environ['PATH']}"
        given = {**os.environ, "PATH": path, **environ}
        folder = CLIENTS / package
        done = subprocess.run(
            words, cwd=folder, env=given, capture_output=True, text=True, timeout=LONGEST
        )
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    return lambda package: partial(assert_runs, package)
