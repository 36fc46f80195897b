"""Time of a newcomer's first demo."""

import subprocess
import tempfile
import time
from pathlib import Path

from rows import Row


def rows(root: Path, from_nothing: bool) -> list[Row]:
    """`make demo` in a fresh clone, installing included."""
    if not from_nothing:
        return []
    with tempfile.TemporaryDirectory() as folder:
        clone = Path(folder) / "posefield"
        subprocess.run(["git", "clone", "--quiet", root, clone], check=True)
        start = time.perf_counter()
        subprocess.run(["make", "demo"], cwd=clone, check=True, stdout=subprocess.DEVNULL)
        seconds = time.perf_counter() - start
    return [Row("make demo in a fresh clone, installing included", seconds, "s", "", None, 300.0)]
