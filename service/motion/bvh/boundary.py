"""A BVH file to a clip: where its unit, its up axis and its root offset are decided."""

from typing import Literal

import numpy as np

from service.motion import quat
from service.motion.bvh.grammar import BvhFile, BvhJoint
from service.motion.clip import Clip
from service.motion.conventions import Floats
from service.motion.skeleton import Skeleton

Up = Literal["y", "z"]
RootOffset = Literal["replace", "add"]


def to_clip(file: BvhFile, *, metres_per_unit: float, up: Up, root_offset: RootOffset) -> Clip:
    """The file's motion in metres with Y up.

    A position channel replaces its component of the OFFSET; one that is missing leaves it. With
    root_offset="add" the root's channels are added to its OFFSET instead, as three.js reads them.
    The rest pose stays what the file says: its OFFSETs and the identity. up="z" turns the basis of
    every offset and local rotation, (x, y, z) to (x, z, -y), so the rest pose stands upright.
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
    rotations[..., 1:] = upright(rotations[..., 1:], up)
    lengths = metres_per_unit * upright(translations, up)
    return Clip(skeleton(file, metres_per_unit, up), rotations, lengths, file.rate)


def upright(vectors: Floats, up: Up) -> Floats:
    """Vectors (..., 3) with Y up; a quaternion's last three components turn alike."""
    return vectors if up == "y" else vectors[..., [0, 2, 1]] * np.array([1.0, 1.0, -1.0])


def skeleton(file: BvhFile, metres_per_unit: float, up: Up) -> Skeleton:
    """The joints and end sites at rest."""
    offsets = np.array([joint.offset for joint in file.joints])
    tips = np.array([offset for _, offset in file.tips]).reshape(-1, 3)
    return Skeleton(
        tuple(joint.name for joint in file.joints),
        tuple(joint.parent for joint in file.joints),
        metres_per_unit * upright(offsets, up),
        tuple(joint for joint, _ in file.tips),
        metres_per_unit * upright(tips, up),
    )


def local_motion(file: BvhFile) -> tuple[Floats, Floats]:
    """Rotations (F, J, 4) and translations (F, J, 3) in the file's unit and axes."""
    frames, joints = len(file.values), len(file.joints)
    rotations, translations = np.empty((frames, joints, 4)), np.empty((frames, joints, 3))
    column = 0
    for index, joint in enumerate(file.joints):
        values = file.values[:, column : column + len(joint.channels)]
        rotations[:, index] = rotation(joint, values)
        translations[:, index] = translation(joint, values)
        column += len(joint.channels)
    return rotations, translations


def rotation(joint: BvhJoint, values: Floats) -> Floats:
    """Quaternions (F, 4) of a joint's columns."""
    turns = [name.endswith("rotation") for name in joint.channels]
    return quat.from_euler(np.deg2rad(values[:, turns]), joint.rotation_axes)


def translation(joint: BvhJoint, values: Floats) -> Floats:
    """Translations (F, 3) of a joint's columns, from its OFFSET where it has none."""
    moved = np.tile(joint.offset, (len(values), 1))
    for column, name in enumerate(joint.channels):
        if name.endswith("position"):
            moved[:, "XYZ".index(name[0])] = values[:, column]
    return moved
