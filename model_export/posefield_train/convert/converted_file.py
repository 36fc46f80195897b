"""A motion file of any format as BVH, in centimetres with Y up."""

import re
import shutil
import subprocess
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from posefield.common.errors import FileError, MotionFileError
from posefield.common.units import Positions
from posefield.motion import bvh_writer
from posefield.motion.clip import Clip
from posefield_train.source import motion_file, motion_readers
from posefield_train.source.motion_file import AS_STATED, MotionFile, ReadOptions

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
            output = " ".join(lines[-4:])[-SHOWN:] or "no output"
            raise MotionFileError(str(source), f"Blender {self.version} cannot read it: {output}")


def find(program: Path | None) -> BlenderProgram:
    """Return the given Blender, or that of the PATH.

    program: Blender itself, or a Python that has the module bpy. Raises FileError if it is neither,
    or older than LEAST_VERSION.
    """
    command_path = shutil.which("blender") if program is None else str(program)
    if command_path is None:
        raise FileError(
            "blender",
            "not found on the PATH, expected an installed Blender, or --blender with its path",
        )
    path = Path(command_path)
    if not path.is_file():
        raise FileError(path, "no such file, expected Blender, or a Python that has bpy")
    by_program = (
        command_path,
        "--background",
        "--factory-startup",
        "--python-exit-code",
        "3",
        "--python",
    )
    for probe, command in (
        ([command_path, "--version"], by_program),
        ([command_path, "-c", "import bpy; print(bpy.app.version_string)"], (command_path,)),
    ):
        output = _run(probe, path).stdout
        version = VERSION.search(output)
        if version and (command == (command_path,) or output.startswith("Blender")):
            return _checked(path, command, version)
    raise FileError(path, "states no version of Blender, expected Blender or a Python with bpy")


def _checked(path: Path, command: tuple[str, ...], version: re.Match[str]) -> BlenderProgram:
    number = version[0].removeprefix("Blender ")
    if (int(version[1]), int(version[2])) < LEAST_VERSION:
        oldest = ".".join(map(str, LEAST_VERSION))
        raise FileError(path, f"is Blender {number}, expected {oldest} or later")
    return BlenderProgram(command, number)


def _run(words: list[str], blamed: Path) -> "subprocess.CompletedProcess[str]":
    try:
        return subprocess.run(
            words, capture_output=True, text=True, errors="replace", check=False, timeout=SECONDS
        )
    except (OSError, subprocess.TimeoutExpired) as fault:
        raise FileError(blamed, f"{words[0]} does not run: {fault}") from fault


METRES_PER_UNIT = 0.01
FBX = ".fbx"
ROUNDING = 1e-5
"""Largest variation of a bone, m, that single precision and baked matrices make."""


@dataclass(frozen=True)
class ConvertedFile:
    """A motion as the content of a BVH file. clip: in metres with Y up. notes: on assumptions."""

    content: bytes
    clip: Clip
    notes: tuple[str, ...]


def convert(
    path: Path, options: ReadOptions = AS_STATED, blender: Path | None = None
) -> ConvertedFile:
    """Return a motion file as BVH. blender: program for FBX files.

    Raises MotionFileError for a file that cannot be read, and for one whose unit or up axis neither
    the file nor the user states; FileError for FBX without Blender.
    """
    file, notes = _read(path, options, blender)
    unit, up = file.metres_per_unit, file.up
    if unit is None or up is None:
        lacks = "unit, expected --unit" if unit is None else "up axis, expected --up"
        raise file.error(f"states no {lacks}; posefield probe proposes it")
    clip = motion_file.to_clip(file, metres_per_unit=unit, up=up)
    clip = replace(clip, translations=_rigid_bones(clip))
    try:
        content = bvh_writer.dumps(clip, metres_per_unit=METRES_PER_UNIT)
    except ValueError as fault:
        raise MotionFileError(str(path), f"cannot be written as BVH: {fault}") from fault
    return ConvertedFile(content, clip, (*notes, *file.notes))


def _rigid_bones(clip: Clip) -> Positions:
    """Return translations in which bones that vary by rounding alone have one length.

    Others would need channels of their own, which few tools read.
    """
    spread = np.ptp(clip.translations, axis=0).max(axis=-1)
    rigid = spread < ROUNDING
    rigid[0] = False
    return np.where(rigid[:, None], clip.translations.mean(axis=0), clip.translations)


def _read(
    path: Path, options: ReadOptions, blender: Path | None
) -> tuple[MotionFile, tuple[str, ...]]:
    if path.suffix.lower() != FBX:
        return motion_readers.read(path, options), ()
    if not path.is_file():
        raise MotionFileError(str(path), "no such file")
    program = find(blender)
    with tempfile.TemporaryDirectory() as folder:
        between = Path(folder, f"{path.stem}.glb")
        program.glb_of_fbx(path, between)
        try:
            motion = motion_readers.read(between, options)
        except MotionFileError as fault:
            raise MotionFileError(str(path), fault.message) from fault
    return motion, (f"{path.name}: read by Blender {program.version}",)
