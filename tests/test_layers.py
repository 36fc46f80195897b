"""Tests of the import rules between the shipped packages and the training packages."""

import ast
import os
import re
import shutil
import subprocess
import sys
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest

from posefield.http import responses

ROOT = Path(__file__).parents[1]
LAYERS = "packages import only those below them"
PACKAGE = ROOT / "service/posefield"
PACKAGES = ("service/posefield", "model_export/posefield_train")

# In a process of its own: nothing of the training job can be imported, as in the image.
HIDDEN = """
import sys

class Hidden:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {"posefield_train", "scipy", "onnx", "pydantic", "matplotlib"}:
            raise ModuleNotFoundError(f"hidden: {name}", name=name)

sys.meta_path.insert(0, Hidden())
"""
# Whoever imports onnxruntime finds telemetry switched off, or fails.
WATCHED = """
import os, sys

class Watch:
    def find_spec(self, name, path=None, target=None):
        if name == "onnxruntime":
            print("telemetry disabled:", os.environ.get("ORT_DISABLE_TELEMETRY"))

os.environ.pop("ORT_DISABLE_TELEMETRY", None)
sys.meta_path.insert(0, Watch())
"""


def lint(folder):
    """Outcome of import-linter over the packages in a folder, by its own contracts."""
    command = [str(Path(sys.executable).parent / "lint-imports"), "--no-cache"]
    paths = os.pathsep.join(str((folder / package).parent) for package in PACKAGES)
    return subprocess.run(
        command,
        cwd=folder,
        env={**os.environ, "PYTHONPATH": paths},
        capture_output=True,
        text=True,
        check=False,
    )


def python(code):
    return subprocess.run(
        [sys.executable, "-W", "error", "-c", code],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.fixture
def copy(tmp_path):
    """The packages and their contracts, to make a hole in."""
    for package in PACKAGES:
        shutil.copytree(ROOT / package, tmp_path / package, ignore=lambda *_: ["__pycache__"])
    shutil.copy(ROOT / ".importlinter", tmp_path)
    return tmp_path


@pytest.mark.system
@pytest.mark.parametrize(
    ("module", "line", "broken"),
    [
        ("service/posefield/motion/clip.py", "import orjson", "the floor needs numpy only"),
        ("service/posefield/motion/clip.py", "import posefield.encode", LAYERS),
        ("service/posefield/inference/session.py", "import onnx", "what ships never imports"),
        (
            "model_export/posefield_train/training.py",
            "import posefield.synthesis",
            "the training job",
        ),
    ],
)
def test_a_planted_breach_is_caught_and_named(copy, module, line, broken):
    path = copy / module
    path.write_text(f"{path.read_text()}\n{line}\n")
    done = lint(copy)
    assert done.returncode == 1
    assert re.search(rf"{re.escape(broken)}[^\n]* BROKEN", done.stdout), done.stdout


def test_what_ships_runs_without_the_training_job():
    packages = "posefield.cli, posefield.http.app"
    done = python(f"{HIDDEN}import {packages}\nprint('fine')")
    assert (done.returncode, done.stdout) == (0, "fine\n"), done.stderr
    # Negative control: a hidden module cannot be imported.
    assert "ModuleNotFoundError: hidden" in python(f"{HIDDEN}import scipy.linalg").stderr


def test_telemetry_is_off_before_onnxruntime_is_imported():
    done = python(f"{WATCHED}import posefield.inference.session")
    assert done.stdout.splitlines() == ["telemetry disabled: 1"], done.stderr
    # Negative control: onnxruntime alone does not find it off.
    assert python(f"{WATCHED}import onnxruntime").stdout == "telemetry disabled: None\n"


# What a request may need and the start must not pay for: 0.25 of 0.85 CPU seconds.
LATE = ("pxr", "jinja2", "obstore", "mcp", "scipy", "onnx", "rich.progress")


def test_the_start_imports_nothing_that_only_some_requests_need():
    started = "posefield.cli, posefield.http.app, posefield_train.cli"
    said = python(f"import sys, {started}; print([m for m in {LATE} if m in sys.modules])")
    assert said.stdout == "[]\n", said.stderr
    # Negative control.
    said = python("import sys, posefield.encode.usd_clip; print('pxr' in sys.modules)")
    assert said.stdout == "True\n", said.stderr


ANSWERING = ("encode", "feet", "inference", "motion", "question", "synthesis")


def test_an_entity_tag_depends_on_every_library_that_makes_answers():
    files = (path for name in ANSWERING for path in (PACKAGE / name).rglob("*.py"))
    nodes = [node for path in files for node in ast.walk(ast.parse(path.read_text()))]
    imported = {
        alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names
    }
    imported |= {node.module for node in nodes if isinstance(node, ast.ImportFrom) and node.module}
    distributions = packages_distributions()
    roots = {name.partition(".")[0] for name in imported} & distributions.keys()
    libraries = {name for root in roots for name in distributions[root]}
    assert "usd-core" in libraries
    assert libraries - {"posefield"} <= set(responses.LIBRARIES)
