"""Checks of the pages at `/` and `/docs` in a browser, for a procedural and a real model."""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import debian
import environment
import httpx
import running
import trained

CLIENTS = environment.ROOT / "clients"
REAL = "cmu_walk"


def faults(node: Path) -> list[str]:
    """Return the page's faults, a line each; print the output of the browser's tests."""
    if reason := debian.missing({"chromium": "chromium"}):
        print(f"no browser: {reason}")
        return []
    real = trained.real(REAL)
    if real is None:
        return []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        models = _models(folder / "models", real)
        (port,) = running.ports(1)
        told = {"POSEFIELD_PORT": str(port), "POSEFIELD_LOG": "off"}
        posefield = Path(sys.executable).with_name("posefield")
        with running.started([posefield, "serve", models], folder / "service.txt", **told):
            address = f"http://127.0.0.1:{port}"
            running.wait(lambda: httpx.get(f"{address}/readyz").status_code == 200)
            return _clicked(node, address, models)


def _models(folder: Path, real: bytes) -> Path:
    folder.mkdir()
    (folder / "reaching.onnx").write_bytes(trained.family()[1])
    (folder / f"{REAL}.onnx").write_bytes(real)
    (folder / "quadruped.onnx").write_bytes(trained.quadruped()[1])
    return folder


def _clicked(node: Path, address: str, models: Path) -> list[str]:
    tests = sorted(CLIENTS.glob("*/test/*.page.ts"))
    told = {
        "POSEFIELD_URL": address,
        "POSEFIELD_MODELS": str(models),
        "POSEFIELD_COMMAND": str(Path(sys.executable).with_name("posefield")),
    }
    return [f"page: {file.name}" for file in tests if not _passed(node, file, told)]


def _passed(node: Path, file: Path, told: dict[str, str]) -> bool:
    """Return whether the tests of a file pass at the first or the second try."""
    # One after the other: they measure. A browser that draws with the processor, beside other work,
    # may miss a wait of some seconds; what fails twice is a fault, and what fails once is said.
    options = ("--test-concurrency=1", "--test-timeout=300000", "--test-reporter=spec")
    command = [node, "--test", *options, file]
    for _ in range(2):
        done = subprocess.run(command, cwd=CLIENTS, env=os.environ | told, text=True)
        if done.returncode == 0:
            return True
        print(f"page: {file.name} ended with {done.returncode}", flush=True)
    return False


if __name__ == "__main__":
    found = faults(environment.node()[0])
    print("\n".join(found) or "no fault in the page")
    sys.exit(bool(found))
