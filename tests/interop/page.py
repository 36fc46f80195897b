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
import runtime_answers
import trained

CLIENTS = environment.ROOT / "clients"
REAL = "cmu_walk"


def faults(node: Path) -> list[str]:
    """Return the page's faults, a line each; print the output of the browser's tests."""
    if reason := debian.missing({"chromium": "chromium"}):
        print(f"no browser: {reason}")
        return []
    contents = models()
    if not contents:
        return []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "models").mkdir()
        for model, content in contents.items():
            (folder / "models" / f"{model}.onnx").write_bytes(content)
        (port,) = running.ports(1)
        told = {"POSEFIELD_PORT": str(port), "POSEFIELD_LOG": "off"}
        posefield = Path(sys.executable).with_name("posefield")
        with running.started(
            [posefield, "serve", folder / "models"], folder / "service.txt", **told
        ):
            address = f"http://127.0.0.1:{port}"
            running.wait(lambda: httpx.get(f"{address}/readyz").status_code == 200)
            return _clicked(node, address, folder / "models")


def models() -> dict[str, bytes]:
    """Files of the models that the page's tests ask for, by name; none without motion capture."""
    real = trained.real(REAL)
    if real is None:
        return {}
    return {"reaching": trained.family()[1], REAL: real, "quadruped": trained.quadruped()[1]}


def _clicked(node: Path, address: str, models: Path) -> list[str]:
    tests = sorted(CLIENTS.glob("*/test/*.page.ts"))
    told = {
        "POSEFIELD_URL": address,
        "POSEFIELD_MODELS": str(models),
        "POSEFIELD_ANSWERS": str(runtime_answers.write(models.parent)),
        "POSEFIELD_COMMAND": str(Path(sys.executable).with_name("posefield")),
    }
    return [f"page: {file.name}" for file in tests if not _passed(node, file, told)]


def _passed(node: Path, file: Path, told: dict[str, str]) -> bool:
    """Return whether the tests of a file pass at one of three tries."""
    # One after the other: they measure. A browser that draws with the processor, beside other work,
    # may miss a wait of some seconds; what fails thrice is a fault, and what fails once is said.
    options = ("--test-concurrency=1", "--test-timeout=300000", "--test-reporter=spec")
    command = [node, "--test", *options, file]
    for _ in range(3):
        done = subprocess.run(command, cwd=CLIENTS, env=os.environ | told, text=True)
        if done.returncode == 0:
            return True
        print(f"page: {file.name} ended with {done.returncode}", flush=True)
    return False


if __name__ == "__main__":
    found = faults(environment.node()[0])
    print("\n".join(found) or "no fault in the page")
    sys.exit(bool(found))
