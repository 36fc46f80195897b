"""Check of curves from end to end: the procedural face is trained and served by the commands.

Its curves are read from USD and glTF in Blender, and from the page in a browser.
"""

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import debian
import environment
import httpx
import numpy as np
import running
from families import face_files
from usd_checks import defects

COMMAND = Path(sys.executable).with_name("posefield")
PAGE_TEST = environment.ROOT / "clients/viewer/test/face.browser.ts"
QUERY = "smile=0.7&openness=0.5&fps=30"
ENDINGS = ("usda", "usdc", "glb")
BODIES = ("mannequin", "none")
FURTHEST = 1e-5
"""Largest difference of a weight in Blender; JSON has six decimals."""


def faults(python: Path, node: Path) -> list[str]:
    """Return the faults of all readers, a line each."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        model = folder / "models/face.onnx"
        _call(COMMAND, "train", face_files.write_family(folder / "face"), "-o", model)
        (port,) = running.ports(1)
        told = {"POSEFIELD_PORT": str(port), "POSEFIELD_LOG": "off"}
        served = running.started([COMMAND, "serve", model.parent], folder / "service.txt", **told)
        with served:
            address = f"http://127.0.0.1:{port}"
            running.wait(lambda: httpx.get(f"{address}/readyz").status_code == 200)
            return [*_in_files(python, node, address, folder), *_in_page(node, address)]


def _in_files(python: Path, node: Path, address: str, folder: Path) -> Iterator[str]:
    meant = _get(address, "json").json()
    files = []
    for body in BODIES:
        # Without a body USD has no mesh, so no shape that Blender could show.
        for ending in ENDINGS if body != "none" else ("glb",):
            files.append(folder / f"{body}.{ending}")
            files[-1].write_bytes(_get(address, ending, f"&body={body}").content)
    result = folder / "curves.npz"
    _call(python, Path(__file__).with_name("blender_curves.py"), result, *files)
    with np.load(result) as found:
        for file in files:
            names, values = found[f"{file.name}/names"], found[f"{file.name}/values"]
            yield from _differences(file.name, names.tolist(), values, meant)
    for file in (file for file in files if file.suffix != ".glb"):
        yield from (f"{file.name}: {line}" for line in defects(file))
    yield from _invalid(node, folder)


def _differences(file: str, names: list[str], values: np.ndarray, meant: dict) -> Iterator[str]:
    expected = np.array(meant["curves"])
    if names != meant["curve_names"] or values.shape != expected.shape:
        yield f"{file}: {len(values)} frames of {names}, expected {len(expected)} of the clip's"
        return
    apart = np.abs(values - expected).max()
    # Negative control: a frame later the weights differ.
    if apart > FURTHEST or np.abs(values[1:] - expected[:-1]).max() < 100 * FURTHEST:
        yield f"{file}: a weight differs by {apart:.1e}, expected at most {FURTHEST}"


def _invalid(node: Path, folder: Path) -> Iterator[str]:
    script, result = Path(__file__).with_name("gltf_validate.mjs"), folder / "khronos.json"
    _call(node, script, environment.THREE / "node_modules", folder, result)
    for file, found in json.loads(result.read_text()).items():
        yield from (f"{file}: {fault}" for fault in found)


def _in_page(node: Path, address: str) -> list[str]:
    if reason := debian.missing({"chromium": "chromium"}):
        print(f"no browser: {reason}")
        return []
    command = [node, "--test", "--test-timeout=300000", PAGE_TEST]
    told = os.environ | {"POSEFIELD_URL": address}
    done = subprocess.run(command, cwd=PAGE_TEST.parents[2], env=told, text=True)
    return [f"{PAGE_TEST.name} ended with {done.returncode}"] * bool(done.returncode)


def _get(address: str, ending: str, more: str = "") -> httpx.Response:
    found = httpx.get(f"{address}/v1/models/face/clip.{ending}?{QUERY}{more}", timeout=60.0)
    return found.raise_for_status()


def _call(*command: str | Path) -> None:
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(f"{command}: {done.stdout[-2000:]}{done.stderr[-2000:]}")


def main() -> int:
    """Exit code: whether a fault was found."""
    found = faults(*environment.prepare())
    print("\n".join(found) or "no fault in the curves of the face")
    return bool(found)


if __name__ == "__main__":
    sys.exit(main())
