"""Reads our USD files back in Blender and three.js and prints how far every joint is off.

    .venv/bin/python tests/interop/run.py

Fails when a reader sees a joint elsewhere than our own kinematics, no animation, or another number
of frames; and when the file that was damaged on purpose passes.
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import cases
import environment
import numpy as np
from compare import Row, compare

HERE = Path(__file__).parent
Read = dict[str, tuple[list[str], np.ndarray]]


def blender(python: Path, folder: Path) -> Read:
    """Joints and matrices of every file in the folder, as Blender sees them."""
    result = folder / "blender.result"
    _call(python, HERE / "blender_read.py", folder, result)
    with np.load(f"{result}.npz") as found:
        files = {key.partition("/")[0] for key in found.files}
        return {f: (found[f"{f}/joints"].tolist(), found[f"{f}/matrices"]) for f in files}


def three(node: Path, folder: Path) -> Read:
    """Joints and matrices of every file in the folder, as three.js sees them."""
    result = folder / "three.result"
    _call(node, HERE / "three_read.mjs", environment.THREE / "node_modules", folder, result)
    found = json.loads(result.read_text())
    return {file: (each["joints"], _matrices(each)) for file, each in found.items()}


def main() -> int:
    """Exit code: how many rows are not as they should be, at most 1."""
    python, node = environment.prepare()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        expected = cases.write(folder)
        rows = [
            compare(file, reader, *read[file], expected[file])
            for reader, read in (
                ("blender", blender(python, folder)),
                ("three", three(node, folder)),
            )
            for file in expected
        ]
    return _report(rows)


def _matrices(each: dict) -> np.ndarray:
    shape = (-1, len(each["joints"]), 4, 4)
    return np.swapaxes(np.array(each["matrices"], float).reshape(shape), -1, -2)


def _report(rows: list[Row]) -> int:
    print(f"{'file':<26}{'reader':<10}{'metres':>10}{'turn':>10}  result")
    wrong = [row for row in rows if row.good == _damaged(row)]
    for row in rows:
        result = ("FAILED" if row in wrong else "ok") + " (damaged on purpose)" * _damaged(row)
        figures = f"{row.metres:>10.1e}{row.turn:>10.1e}"
        print(f"{row.file:<26}{row.reader:<10}{figures}  {result} {row.fault}")
    print(f"{len(rows) - len(wrong)} of {len(rows)} as expected")
    return bool(wrong)


def _damaged(row: Row) -> bool:
    return row.file.startswith(f"{cases.CONTROL}.")


def _call(*command: Path) -> None:
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{command[1]} failed:\n{done.stdout[-2000:]}\n{done.stderr[-2000:]}")


if __name__ == "__main__":
    sys.exit(main())
