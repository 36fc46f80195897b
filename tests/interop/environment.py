"""Environment of the checks: Blender as a Python module, three.js on Node, the Khronos glTF
validator, Redocly for the contract, and further packages.

The machine needs only Python 3.11; missing Debian libraries for Blender are downloaded.
"""

import os
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

ROOT = Path(__file__).parents[2]
# Helpers of the tests that these checks use too.
sys.path.append(str(ROOT / "tests"))
THREE = ROOT / "build" / "three"
NEWEST, OLDER = "5.0.1", "4.5.15"
"""Versions of Blender: CI takes the newest, `make test-all` the older one too."""
NODE_PACKAGES = ("three@0.187.0", "gltf-validator@2.0.0-dev.3.10", "@redocly/cli@2.77.0")

# What ldd names for bpy's own library beyond libc and libstdc++.
LIBRARIES = (
    "libgl1 libegl1 libsm6 libice6 libx11-6 libxext6 libxfixes3 libxi6 libxrender1 libxt6"
    " libxkbcommon0 libxxf86vm1"
).split()


def prepare() -> tuple[Path, Path]:
    """The Python that has Blender and the node beside three.js, installed when they are not."""
    found = node()
    modules(THREE, NODE_PACKAGES, *found)
    return blender(NEWEST), found[0]


def blender(version: str) -> Path:
    """The Python that has Blender as a module, with the libraries that Blender needs."""
    venv = ROOT / (".venv-blender" if version == NEWEST else ".venv-blender-older")
    python = packages(venv, (f"bpy=={version}", "numpy<2"))
    if not _imports(python):
        _libraries()
        if not _imports(python):
            sys.exit(f"Blender does not start; install {' '.join(LIBRARIES)} (Debian's names)")
    return python


def packages(venv: Path, wanted: Sequence[str]) -> Path:
    """The Python of an environment that has the packages, installed when it has not."""
    python, stamp = venv / "bin" / "python", venv / ".installed"
    if _once(stamp, " ".join(wanted)):
        _run(sys.executable, "-m", "venv", venv)
        _run(python, "-m", "pip", "install", "--quiet", *wanted)
        _done(stamp, " ".join(wanted))
    return python


def modules(folder: Path, wanted: Sequence[str], node: Path, npm: Path) -> Path:
    """The node_modules that have the packages, installed when they have not."""
    stamp = folder / ".installed"
    if _once(stamp, " ".join(wanted)):
        folder.mkdir(parents=True, exist_ok=True)
        _run(npm, "install", "--silent", "--no-save", "--prefix", folder, *wanted, node=node)
        _done(stamp, " ".join(wanted))
    return folder / "node_modules"


def node() -> tuple[Path, Path]:
    """node and npm, which the lock file of the development environment names."""
    folder = Path(sys.executable).parent
    return folder / "node", folder / "npm"


def _libraries() -> None:
    if os.geteuid() == 0 and shutil.which("apt-get"):
        _run("apt-get", "update", "-qq")
        _run("apt-get", "install", "-qq", "--yes", "--no-install-recommends", *LIBRARIES)


def _imports(python: Path) -> bool:
    found = subprocess.run([python, "-c", "import bpy"], capture_output=True, text=True)
    if found.returncode:
        print(found.stderr.strip().splitlines()[-1:], file=sys.stderr)
    return found.returncode == 0


def _once(stamp: Path, version: str) -> bool:
    return not stamp.exists() or stamp.read_text() != version


def _done(stamp: Path, version: str) -> None:
    stamp.write_text(version)


def _run(*command: str | Path, node: Path | None = None) -> None:
    # npm looks for its node on the path.
    path = f"{node.parent}{os.pathsep}{os.environ['PATH']}" if node else os.environ["PATH"]
    subprocess.run(command, check=True, env=os.environ | {"PATH": path})


if __name__ == "__main__":
    print(*prepare(), sep="\n")
