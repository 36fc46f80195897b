"""Interoperability checks; prints the position errors of joints in Blender and three.js.

    .venv/bin/python tests/interop/run.py [--others]

It fails if a reader differs from the kinematics of this project, finds no animation or another
number of frames, and if a deliberately damaged or known unsupported file passes. glTF files must
pass the Khronos validator without errors and warnings, and the contract must pass Redocly. Then it
builds and queries the image, and checks a cache before the service, the model in other engines and
in the C example, the page in a browser, glTF files in Godot and the Blender add-on. `--others` runs
what CI does not: the add-on in the older Blender, and the Rust example, whose build takes minutes.
"""

import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import addon
import avatars
import blender_bvh
import blender_motion
import blends
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
import people
import programs
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
    """Exit code: 1 if a row is not as it should be or a part has a fault."""
    if sys.argv[1:] == ["--others"]:
        return _print_faults(
            addon=lambda: addon.faults(environment.OLDER), rust=programs.rust_faults
        )
    python, node = environment.prepare()
    # Two threads would train the same models twice.
    page.models()
    return _print_faults(
        readers=lambda: _readers(python, node),
        bvh=lambda: blender_bvh.faults(python),
        motion=lambda: blender_motion.faults(python),
        contract=lambda: lint.faults(node),
        image=container.faults,
        cache=cache.faults,
        slow_clients=slow_clients.faults,
        curves=lambda: faces.faults(python, node),
        engines=lambda: engines.faults(*environment.node()),
        c=programs.c_faults,
        blends=lambda: blends.faults(node),
        avatars=lambda: avatars.faults(*environment.node()),
        page=lambda: page.faults(node),
        addon=addon.faults,
        godot=godot.faults,
        people=people.faults,
    )


def _print_faults(**parts: Callable[[], list[str]]) -> int:
    """Run the parts, and print their faults and how long each took; 1 if there is a fault."""
    # The browser's tests mostly wait: they run beside all other parts.
    with ThreadPoolExecutor(1) as pool:
        apart = {name: pool.submit(_timed, parts[name]) for name in parts if name == "page"}
        results = {name: _timed(part) for name, part in parts.items() if name not in apart}
        results |= {name: future.result() for name, future in apart.items()}
    faults = [fault for found, _ in results.values() for fault in found]
    print("\n".join(faults) or "no fault in what runs elsewhere")
    print("; ".join(f"{name} {seconds:.0f} s" for name, (_, seconds) in results.items()))
    return bool(faults)


def _timed(part: Callable[[], list[str]]) -> tuple[list[str], float]:
    began = time.monotonic()
    faults = part()
    return faults, time.monotonic() - began


def _readers(python: Path, node: Path) -> list[str]:
    """Faults of exported files, and of what Blender, three.js and the Khronos validator read."""
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
    return faults + _report(rows)


def _matrices(each: dict) -> np.ndarray:
    shape = (len(each["matrices"]), len(each["joints"]), 4, 4)
    return np.swapaxes(np.array(each["matrices"], float).reshape(shape), -1, -2)


def _report(rows: list[Row]) -> list[str]:
    """Print the rows, and return a line for each that is not as it should be."""
    print(f"{'file':<26}{'reader':<10}{'metres':>10}{'turn':>10}  result")
    wrong = [row for row in rows if row.good == bool(_unreadable(row))]
    for row in rows:
        result = ("FAILED" if row in wrong else "ok") + _unreadable(row)
        figures = f"{row.metres:>10.1e}{row.turn:>10.1e}"
        print(f"{row.file:<26}{row.reader:<10}{figures}  {result} {row.fault}")
    print(f"{len(rows) - len(wrong)} of {len(rows)} as expected")
    return [f"{row.file} in {row.reader} is not as expected" for row in wrong]


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
