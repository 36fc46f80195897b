"""Interoperability checks; prints the position errors of joints in Blender and three.js.

    .venv/bin/python tests/interop/run.py

It fails if a reader differs from the kinematics of this project, finds no animation or another
number of frames, and if a deliberately damaged or known unsupported file passes. glTF files must
pass the Khronos validator without errors and warnings, and the contract must pass Redocly. Then it
builds and queries the image, and checks a cache before the service, the model in other engines, the
page in a browser, glTF files in Godot and the Blender add-on.
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import addon
import blender_bvh
import blender_motion
import cache
import cases
import container
import crowds
import engines
import environment
import exports
import faces
import godot
import lint
import numpy as np
import page
import slow_clients
from compare import Characters, Row, compare

HERE = Path(__file__).parent
Read = dict[str, Characters]


def blender(python: Path, folder: Path) -> Read:
    """Joints and matrices of every file in the folder, as Blender sees them."""
    result = folder / "blender.result"
    _call(python, HERE / "blender_read.py", folder, result)
    read: Read = {}
    with np.load(f"{result}.npz") as found:
        for key in found.files:
            file, who, _ = key.split("/")
            motion = found[f"{file}/{who}/joints"].tolist(), found[f"{file}/{who}/matrices"]
            read.setdefault(file, {})[who] = motion
    return read


def three(node: Path, folder: Path) -> Read:
    """Joints and matrices of every file in the folder, as three.js sees them."""
    result = folder / "three.result"
    _call(node, HERE / "three_read.mjs", environment.THREE / "node_modules", folder, result)
    found = json.loads(result.read_text())
    return {
        file: {who: (each["joints"], _matrices(each)) for who, each in characters.items()}
        for file, characters in found.items()
    }


def khronos(node: Path, folder: Path) -> list[Row]:
    """A row for each glTF file of the folder, whose fault is what the validator finds."""
    result = folder / "khronos.result"
    script = HERE / "gltf_validate.mjs"
    _call(node, script, environment.THREE / "node_modules", folder, result)
    found = json.loads(result.read_text())
    return [Row(file, "khronos", 0.0, 0.0, "; ".join(faults)) for file, faults in found.items()]


def main() -> int:
    """Exit code: how many rows are not as they should be, at most 1."""
    python, node = environment.prepare()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        expected = cases.write(folder) | crowds.write(folder) | exports.write(folder)
        faults = exports.faults(folder)
        rows = [
            compare(file, reader, read.get(file, {}), expected[file])
            for reader, read in (
                ("blender", blender(python, folder)),
                ("three", three(node, folder)),
            )
            for file in expected
        ]
        cases.write_invalid(folder)
        rows += khronos(node, folder)
    print("\n".join(faults) or f"no fault in {exports.CLIPS} exported files")
    wrong = _report(rows)
    others = blender_bvh.faults(python) + lint.faults(node) + container.faults() + cache.faults()
    others += blender_motion.faults(python) + slow_clients.faults()
    others += faces.faults(python, node)
    others += engines.faults(*environment.node()) + page.faults(node) + addon.faults()
    others += godot.faults()
    print("\n".join(others) or "no fault in what runs elsewhere")
    return wrong or bool(faults + others)


def _matrices(each: dict) -> np.ndarray:
    shape = (len(each["matrices"]), len(each["joints"]), 4, 4)
    return np.swapaxes(np.array(each["matrices"], float).reshape(shape), -1, -2)


def _report(rows: list[Row]) -> int:
    print(f"{'file':<26}{'reader':<10}{'metres':>10}{'turn':>10}  result")
    wrong = [row for row in rows if row.good == bool(_unreadable(row))]
    for row in rows:
        result = ("FAILED" if row in wrong else "ok") + _unreadable(row)
        figures = f"{row.metres:>10.1e}{row.turn:>10.1e}"
        print(f"{row.file:<26}{row.reader:<10}{figures}  {result} {row.fault}")
    print(f"{len(rows) - len(wrong)} of {len(rows)} as expected")
    return bool(wrong)


def _unreadable(row: Row) -> str:
    """Why a file must not be read as it was meant; empty where it must."""
    name = row.file.partition(".")[0]
    if row.reader == "khronos":
        # Quaternions in another order are rotations too.
        return " (damaged on purpose)" if row.file == cases.INVALID else ""
    if name in (cases.CONTROL, crowds.CONTROL):
        return " (damaged on purpose)"
    return " (known not to be read)" if (row.reader, name) in crowds.UNREAD else ""


def _call(*command: Path) -> None:
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{command[1]} failed:\n{done.stdout[-2000:]}\n{done.stderr[-2000:]}")


if __name__ == "__main__":
    sys.exit(main())
