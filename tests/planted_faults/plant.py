"""Plant faults that a user would notice, one after another, and say which the tests find.

    .venv/bin/python tests/planted_faults/plant.py [ROOT] [NAME ...]

ROOT: checkout whose tests run, with its environment in .venv; this one by default. Each fault is
planted in a copy, so that the checkout stays as it is. Exits with 1 if a fault is not found, or if
the text to replace does not stand exactly once in the product.
"""

import os
import shutil
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

HERE = Path(__file__).parent
PACKAGES = ("service/posefield", "model_export/posefield_train", "clients/python/posefield_client")
UNCOPIED = shutil.ignore_patterns(".git", ".venv*", "node_modules", ".*_cache", "dist", "site")


def main() -> int:
    """Return the exit code."""
    words = sys.argv[1:]
    root = Path(words.pop(0)) if words and Path(words[0]).is_dir() else HERE.parents[1]
    faults = tomllib.loads((HERE / "faults.toml").read_text())
    missed = []
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder, "copy")
        shutil.copytree(root, copy, ignore=UNCOPIED, symlinks=True)
        for name in words or faults:
            result = find(faults[name], root.resolve(), copy)
            print(f"{name}: {result}", flush=True)
            missed += [] if result.startswith("found") else [name]
    print(f"{len(missed)} of {len(words or faults)} not found: {', '.join(missed) or 'none'}")
    return bool(missed)


def find(fault: dict[str, str], root: Path, copy: Path) -> str:
    """Plant a fault in the copy, run the tests, take it out again, and return what they said."""
    sources = [file for package in PACKAGES for file in sorted((copy / package).rglob("*.py"))]
    holding = [file for file in sources if fault["find"] in file.read_text()]
    count = sum(file.read_text().count(fault["find"]) for file in holding)
    if count != 1:
        return f"not planted, its text stands {count} times in the product"
    tests = sorted(
        str(file.relative_to(copy))
        for file in (copy / "tests").rglob("test_*.py")
        if any(word in str(file.relative_to(copy / "tests")) for word in fault["tests"])
    )
    if not tests:
        return f"no test file has one of {fault['tests']} in its path"
    (file,) = holding
    text = file.read_text()
    file.write_text(text.replace(fault["find"], fault["replace"]))
    try:
        return run(tests, root, copy)
    finally:
        file.write_text(text)


def run(tests: list[str], root: Path, copy: Path) -> str:
    """Return what the tests say of the copy: the first that fails, or that all pass."""
    # Before the installed checkout, whose place the copy takes.
    path = os.pathsep.join(str((copy / package).parent) for package in PACKAGES)
    options = ["-q", "-x", "-n", "0", "-p", "no:cacheprovider", "-m", "not system", "--no-header"]
    done = subprocess.run(
        [root / ".venv/bin/python", "-m", "pytest", *options, *tests],
        cwd=copy,
        env=os.environ | {"PYTHONPATH": path},
        capture_output=True,
        text=True,
    )
    failed = [line for line in done.stdout.splitlines() if line.startswith(("FAILED", "ERROR"))]
    if done.returncode == 0:
        return f"NOT FOUND by {' '.join(tests)}"
    return (
        f"found: {failed[0][:150]}"
        if failed
        else f"broken: {done.stdout[-300:]}{done.stderr[-300:]}"
    )


if __name__ == "__main__":
    sys.exit(main())
