"""Blender as an external program: where it is, its version, and FBX files to GLB by it.

Blender is GPL software of 350 MB and is no dependency: it is run as a program.
"""

import re
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

from posefield.common.errors import FileError, MotionFileError

SCRIPT = Path(__file__).with_name("blender_script.py")
LEAST_VERSION = (4, 2)
VERSION = re.compile(r"^(?:Blender )?(\d+)\.(\d+)(\.\d+)?", re.MULTILINE)
SECONDS = 600.0
"""Limit of a run: Blender reads minutes of motion in seconds."""
SHOWN = 300


@dataclass(frozen=True)
class BlenderProgram:
    """An installed Blender. command: words before the script. version: as it states."""

    command: tuple[str, ...]
    version: str

    def glb_of_fbx(self, source: Path, target: Path) -> None:
        """Write an FBX file as GLB; MotionFileError with Blender's last output if it fails."""
        words = [*self.command, str(SCRIPT), "--", str(source.resolve()), str(target)]
        done = _run(words, source)
        if done.returncode or not target.is_file():
            lines = [line for line in (done.stdout + done.stderr).splitlines() if line.strip()]
            said = " ".join(lines[-4:])[-SHOWN:] or "no output"
            raise MotionFileError(str(source), f"Blender {self.version} cannot read it: {said}")


def find(given: Path | None) -> BlenderProgram:
    """Return the given Blender, or that of the PATH.

    given: the program, or a Python that has the module bpy. Raises FileError if it is neither, or
    older than LEAST_VERSION.
    """
    found = shutil.which("blender") if given is None else str(given)
    if found is None:
        raise FileError(
            "blender",
            "not found on the PATH, expected an installed Blender, or --blender with its path",
        )
    path = Path(found)
    if not path.is_file():
        raise FileError(path, "no such file, expected Blender, or a Python that has bpy")
    by_program = (found, "--background", "--factory-startup", "--python-exit-code", "3", "--python")
    for probe, command in (
        ([found, "--version"], by_program),
        ([found, "-c", "import bpy; print(bpy.app.version_string)"], (found,)),
    ):
        said = _run(probe, path).stdout
        version = VERSION.search(said)
        if version and (command == (found,) or said.startswith("Blender")):
            return _checked(path, command, version)
    raise FileError(path, "states no version of Blender, expected Blender or a Python with bpy")


def _checked(path: Path, command: tuple[str, ...], version: re.Match[str]) -> BlenderProgram:
    """Return the program; FileError if it is too old."""
    number = version[0].removeprefix("Blender ")
    if (int(version[1]), int(version[2])) < LEAST_VERSION:
        least = ".".join(map(str, LEAST_VERSION))
        raise FileError(path, f"is Blender {number}, expected {least} or later")
    return BlenderProgram(command, number)


def _run(words: list[str], blamed: Path) -> "subprocess.CompletedProcess[str]":
    try:
        return subprocess.run(
            words, capture_output=True, text=True, errors="replace", check=False, timeout=SECONDS
        )
    except (OSError, subprocess.TimeoutExpired) as fault:
        raise FileError(blamed, f"{words[0]} does not run: {fault}") from fault
