"""A motion file of any format as BVH, in centimetres with Y up."""

import tempfile
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from posefield.common.array_shapes import Positions
from posefield.common.errors import MotionFileError
from posefield.common.units import UpAxis
from posefield.motion import bvh_writer
from posefield.motion.clip import Clip
from posefield_train.convert import blender_program
from posefield_train.source import motion_file, motion_readers
from posefield_train.source.motion_file import AS_STATED, MotionFile, ReadOptions

METRES_PER_UNIT = 0.01
FBX = ".fbx"
ROUNDING = 1e-5
"""Largest variation of a bone, m, that single precision and baked matrices make."""


@dataclass(frozen=True)
class Conventions:
    """Conventions of a file as a user gives them; None for those that the file states.

    metres_per_unit, up: of the file. options: rate and animation. blender: program for FBX files.
    """

    metres_per_unit: float | None = None
    up: UpAxis | None = None
    options: ReadOptions = AS_STATED
    blender: Path | None = None


@dataclass(frozen=True)
class ConvertedFile:
    """A motion as the content of a BVH file. clip: in metres with Y up. notes: on assumptions."""

    content: bytes
    clip: Clip
    notes: tuple[str, ...]


def convert(path: Path, said: Conventions) -> ConvertedFile:
    """Return a motion file as BVH.

    Raises MotionFileError for a file that cannot be read, and for one whose unit or up axis neither
    the file nor the user states; FileError for FBX without Blender.
    """
    file, notes = _read(path, said)
    unit = said.metres_per_unit if said.metres_per_unit is not None else file.metres_per_unit
    up = said.up or file.up
    if unit is None or up is None:
        lacks = "--unit" if unit is None else "--up"
        raise file.error(
            f"states no {'unit' if unit is None else 'up axis'}, expected {lacks}; posefield probe "
            "proposes it"
        )
    clip = motion_file.to_clip(file, metres_per_unit=unit, up=up, rate=said.options.rate)
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


def _read(path: Path, said: Conventions) -> tuple[MotionFile, tuple[str, ...]]:
    """Return the motion of a file, and the note on Blender if it was needed."""
    if path.suffix.lower() != FBX:
        return motion_readers.read(path, said.options), ()
    if not path.is_file():
        raise MotionFileError(str(path), "no such file")
    program = blender_program.find(said.blender)
    with tempfile.TemporaryDirectory() as folder:
        between = Path(folder, f"{path.stem}.glb")
        program.glb_of_fbx(path, between)
        try:
            found = motion_readers.read(between, said.options)
        except MotionFileError as fault:
            raise MotionFileError(str(path), fault.message) from fault
    return found, (f"{path.name}: read by Blender {program.version}",)
