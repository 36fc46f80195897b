"""Conversion of a motion file to a clip by the recipe, which its own facts must agree with."""

from typing import Literal

import numpy as np

from posefield.common.units import Floats, UpAxis
from posefield.motion.clip import Clip
from posefield.motion.skeleton import Skeleton
from posefield_train.source.motion_files.motion_file import MotionFile

RootOffset = Literal["replace", "add"]

SAME = 1e-4
"""Largest relative difference of two numbers that state the same unit or rate."""


def to_clip(
    file: MotionFile,
    *,
    metres_per_unit: float,
    up: UpAxis,
    root_offset: RootOffset = "replace",
    rate: float | None = None,
) -> Clip:
    """Return the file's motion in metres with Y up.

    up="z" turns the basis of every offset and local rotation, (x, y, z) to (x, z, -y), so the rest
    pose stands upright. root_offset="add" adds the root's OFFSET to its path, as three.js does.
    rate: frames a second, needed for a file without one. Raises MotionFileError if the file states
    otherwise, ValueError for an invalid argument.
    """
    if not (np.isfinite(metres_per_unit) and metres_per_unit > 0):
        raise ValueError(f"metres_per_unit {metres_per_unit}, expected a positive number")
    if up not in ("y", "z") or root_offset not in ("replace", "add"):
        raise ValueError(
            f"up {up!r}, root_offset {root_offset!r}; expected 'y' or 'z', 'replace' or 'add'"
        )
    check_stated(file, metres_per_unit, up, rate)
    rotations, translations = file.rotations, file.translations
    if root_offset == "add":
        translations = translations.copy()
        translations[:, 0] += np.array(file.added_offset)
    if up != "y":
        rotations = np.concatenate([rotations[..., :1], to_y_up(rotations[..., 1:], up)], axis=-1)
    lengths = metres_per_unit * to_y_up(translations, up)
    return Clip(_upright(file.skeleton, metres_per_unit, up), rotations, lengths, _rate(file, rate))


def check_stated(file: MotionFile, metres_per_unit: float, up: UpAxis, rate: float | None) -> None:
    """Raise MotionFileError if a file states another unit, up axis or rate than the recipe."""
    stated = file.metres_per_unit
    if stated is not None and abs(stated - metres_per_unit) > SAME * stated:
        raise file.error(
            f"states a unit of {stated:g} m, expected source.metres_per_unit {metres_per_unit:g}"
        )
    if file.up is not None and file.up != up:
        raise file.error(f"states {file.up} as its up axis, expected source.up {up!r}")
    if rate is not None and file.rate is not None and abs(file.rate - rate) > SAME * rate:
        raise file.error(
            f"has {file.rate:g} frames a second ({file.evidence}), expected source.rate {rate:g}"
        )


def _rate(file: MotionFile, rate: float | None) -> float:
    found = rate if file.rate is None else file.rate
    if found is None:
        raise file.error(
            f"{file.format} files state no frame rate, expected source.rate, frames a second"
        )
    return found


def to_y_up(vectors: Floats, up: UpAxis) -> Floats:
    """Return vectors (..., 3) with Y up; the last three components of a quaternion turn alike."""
    return vectors if up == "y" else vectors[..., [0, 2, 1]] * np.array([1.0, 1.0, -1.0])


def _upright(joints: Skeleton, metres_per_unit: float, up: UpAxis) -> Skeleton:
    """Return a skeleton in the unit and axes of a file in metres with Y up."""
    return Skeleton(
        joints.names,
        joints.parents,
        metres_per_unit * to_y_up(joints.offsets, up),
        joints.tip_joints,
        metres_per_unit * to_y_up(joints.tip_offsets, up),
    )
