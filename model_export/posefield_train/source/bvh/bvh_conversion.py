"""Conversion of a BVH file to a clip, given its unit, up axis and root offset."""

from typing import Literal

import numpy as np

from posefield.common.units import Floats, UpAxis
from posefield.motion import quat
from posefield.motion.clip import Clip
from posefield.motion.skeleton import Skeleton
from posefield_train.source.bvh.bvh_content import BvhFile, BvhJoint

RootOffset = Literal["replace", "add"]

BLOCK_JOINTS = 50_000
"""Rotations per block."""


def to_clip(file: BvhFile, *, metres_per_unit: float, up: UpAxis, root_offset: RootOffset) -> Clip:
    """Return the file's motion in metres with Y up.

    A position channel replaces its component of the OFFSET; without a channel the OFFSET stays.
    With root_offset="add" the root's channels are added to its OFFSET instead, as in three.js. The
    rest pose is the file's OFFSETs with identity rotations. up="z" turns the basis of every offset
    and local rotation, (x, y, z) to (x, z, -y), so the rest pose stands upright. Raises ValueError
    for an invalid argument.
    """
    if not (np.isfinite(metres_per_unit) and metres_per_unit > 0):
        raise ValueError(f"metres_per_unit {metres_per_unit}, expected a positive number")
    if up not in ("y", "z") or root_offset not in ("replace", "add"):
        raise ValueError(
            f"up {up!r}, root_offset {root_offset!r}; expected 'y' or 'z', 'replace' or 'add'"
        )
    rotations, translations = local_motion(file)
    if root_offset == "add":
        root = file.joints[0]
        moved = [f"{axis}position" in root.channels for axis in "XYZ"]
        translations[:, 0] += np.where(moved, root.offset, 0.0)
    rotations[..., 1:] = to_y_up(rotations[..., 1:], up)
    lengths = metres_per_unit * to_y_up(translations, up)
    return Clip(skeleton(file, metres_per_unit, up), rotations, lengths, file.rate)


def to_y_up(vectors: Floats, up: UpAxis) -> Floats:
    """Return vectors (..., 3) with Y up; the last three components of a quaternion turn alike."""
    return vectors if up == "y" else vectors[..., [0, 2, 1]] * np.array([1.0, 1.0, -1.0])


def skeleton(file: BvhFile, metres_per_unit: float, up: UpAxis) -> Skeleton:
    """Return the joints and end sites at rest, m."""
    offsets = np.array([joint.offset for joint in file.joints])
    tips = np.array([offset for _, offset in file.tips]).reshape(-1, 3)
    return Skeleton(
        tuple(joint.name for joint in file.joints),
        tuple(joint.parent for joint in file.joints),
        metres_per_unit * to_y_up(offsets, up),
        tuple(joint for joint, _ in file.tips),
        metres_per_unit * to_y_up(tips, up),
    )


def local_motion(file: BvhFile) -> tuple[Floats, Floats]:
    """Return rotations (F, J, 4) and translations (F, J, 3) in the file's unit and axes."""
    frames, joints = len(file.values), len(file.joints)
    rotations, translations = np.empty((frames, joints, 4)), np.empty((frames, joints, 3))
    turning: dict[str, list[tuple[int, list[int]]]] = {}
    column = 0
    for index, joint in enumerate(file.joints):
        end = column + len(joint.channels)
        translations[:, index] = translation(joint, file.values[:, column:end])
        turns = [column + i for i, name in enumerate(joint.channels) if name.endswith("rotation")]
        turning.setdefault(joint.rotation_axes, []).append((index, turns))
        column = end
    for axes, alike in turning.items():
        # Convert joints with the same axis order together, in blocks of small arrays.
        step = max(1, BLOCK_JOINTS // frames)
        for start in range(0, len(alike), step):
            some = alike[start : start + step]
            angles = np.deg2rad(file.values[:, [turns for _, turns in some]])
            rotations[:, [index for index, _ in some]] = quat.from_euler(angles, axes)
    return rotations, translations


def translation(joint: BvhJoint, values: Floats) -> Floats:
    """Return translations (F, 3) of a joint, its OFFSET where channels are missing."""
    moved = np.tile(joint.offset, (len(values), 1))
    for column, name in enumerate(joint.channels):
        if name.endswith("position"):
            moved[:, "XYZ".index(name[0])] = values[:, column]
    return moved
