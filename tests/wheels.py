"""The wheels and sdists of this checkout, and fresh environments that hold nothing but them."""

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
UV = Path(sys.executable).parent / "uv"
NAMES = ("posefield", "posefield-train", "posefield-client")


def build(folder):
    """Write the wheels and sdists into a folder."""
    for name in NAMES:
        subprocess.run([UV, "build", "-q", "--package", name, "-o", folder], cwd=ROOT, check=True)


def install(dist, folder, python, *packages):
    """Return `bin` of a fresh environment with these packages, at the versions of the lock file."""
    pins = folder / "pins.txt"
    options = {"cwd": ROOT, "check": True, "stdout": subprocess.DEVNULL}
    export = ["export", "--frozen", "--quiet", "--all-packages", "--all-extras", "--no-dev"]
    words = ["--no-hashes", "--no-emit-workspace", "--output-file", pins]
    subprocess.run([UV, *export, *words], **options)
    subprocess.run([UV, "venv", "--quiet", "--python", python, folder / "env"], **options)
    where = ["--python", folder / "env/bin/python", "--find-links", dist, "--constraints", pins]
    fresh = [f"--refresh-package={name}" for name in NAMES]  # Not of a like path of another run.
    subprocess.run([UV, "pip", "install", "--quiet", *fresh, *where, *packages], **options)
    return folder / "env/bin"
