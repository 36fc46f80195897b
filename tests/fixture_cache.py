"""Cache of generated fixture files in build/fixtures, keyed by a digest of their dependencies.

It is shared by the processes of a run and by later runs. A lock per file, as pytest-xdist's
documentation recommends, prevents concurrent builds of the same file.
"""

import functools
import hashlib
import os
import pickle
import platform
import re
import shutil
import tempfile
import tomllib
from collections.abc import Callable, Iterator
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from filelock import FileLock

ROOT = Path(__file__).parents[1]
FOLDER = ROOT / "build" / "fixtures"
SOURCES = (
    "model_export",
    "service/posefield/__init__.py",
    "service/posefield/common",
    "service/posefield/inference",
    "service/posefield/kriging",
    "service/posefield/model_file",
    "service/posefield/motion",
    "service/posefield/question",
    "service/posefield/rigs",
    "service/posefield/robots",
    "service/posefield/roles",
    "tests/families",
    "tests/fixture_cache.py",
    "tests/fixture_models.py",
)
"""The code that trains. `test_fixture_cache` proves that it imports nothing else of the project."""

KEPT = 6
"""Digests whose files stay; those of the least recently used go."""


def path(name: str, build: Callable[[Path], object]) -> Path:
    """Return the path of a kept file or folder; `build` writes it to the path given where missing.

    Tests only read what is kept: one that changes a file copies it first.
    """
    place = FOLDER / digest() / name
    if not place.exists():
        place.parent.mkdir(parents=True, exist_ok=True)
        with FileLock(f"{place}.lock"):
            if not place.exists():
                _make(place, build)
    return place


def value(name: str, build: Callable[[], Any]) -> Any:
    """Return a kept object, pickled; `build` makes it where it is missing."""
    place = path(f"{name}.pickle", lambda new: new.write_bytes(pickle.dumps(build())))
    return pickle.loads(place.read_bytes())


def model(name: str) -> Path:
    """Return the kept file of one of the models in `fixture_models`."""

    def build(new: Path) -> None:
        # It imports everything that trains, which a kept file does not need.
        import fixture_models

        new.write_bytes(fixture_models.exported(name).content)

    return path(f"{name}.onnx", build)


@functools.cache
def digest() -> str:
    """Return the name of the folder of what is kept for the project as it is now."""
    name = digest_of(ROOT)
    _forget_old(name)
    return name


def digest_of(root: Path) -> str:
    """Return the digest of a checkout's code that trains, of libraries, interpreter and place."""
    found = hashlib.sha256()
    for fact in _environment():
        found.update(f"{fact}\0".encode())
    for file in sources(root):
        found.update(f"{file}\0".encode() + hashlib.sha256((root / file).read_bytes()).digest())
    return found.hexdigest()[:16]


def sources(root: Path) -> list[Path]:
    """Return the files of a checkout that the kept ones depend on, relative to its root."""
    found = []
    for name in SOURCES:
        place = root / name
        found += [place] if place.is_file() else [*place.rglob("*.py"), *place.rglob("*.toml")]
    return sorted(file.relative_to(root) for file in found)


def _environment() -> Iterator[str]:
    # Absolute paths of the clips are in what is pickled.
    yield str(FOLDER)
    yield f"{platform.python_implementation()} {platform.python_version()} {platform.machine()}"
    files = [ROOT / folder / "pyproject.toml" for folder in ("service", "model_export")]
    projects = [tomllib.loads(file.read_text())["project"] for file in files]
    for line in [line for project in projects for line in project["dependencies"]]:
        name = re.split(r"[\[<>=!~ ;]", line, maxsplit=1)[0]
        try:
            yield f"{name} {version(name)}"
        except PackageNotFoundError:
            yield f"{name} missing"


def _make(place: Path, build: Callable[[Path], object]) -> None:
    """Write beside, then rename: an interrupted run leaves nothing that looks whole."""
    with tempfile.TemporaryDirectory(dir=place.parent) as folder:
        new = Path(folder) / place.name
        build(new)
        new.rename(place)


def _forget_old(current: str) -> None:
    FOLDER.mkdir(parents=True, exist_ok=True)
    with FileLock(FOLDER / ".lock"):
        (FOLDER / current).mkdir(exist_ok=True)
        os.utime(FOLDER / current)
        folders = [each for each in FOLDER.iterdir() if each.is_dir()]
        folders.sort(key=lambda each: each.stat().st_mtime, reverse=True)
        for folder in folders[KEPT:]:
            shutil.rmtree(folder, ignore_errors=True)
