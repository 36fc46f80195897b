"""Conversion of a BVH file to joints and their motion, and to a clip."""

import numpy as np

from posefield.common.units import Floats, UpAxis
from posefield.motion import quat
from posefield.motion.clip import Clip
from posefield.motion.skeleton import Skeleton
from posefield_train.source.bvh.bvh_content import BvhFile, BvhJoint
from posefield_train.source.motion_files import clip_conversion
from posefield_train.source.motion_files.clip_conversion import RootOffset
from posefield_train.source.motion_files.motion_file import MotionFile

BLOCK_JOINTS = 50_000
"""Rotations per block."""


def motion_file(file: BvhFile) -> MotionFile:
    """Return the file's joints and their motion in its own unit and axes.

    A position channel replaces its component of the OFFSET; without a channel the OFFSET stays. The
    rest pose is the file's OFFSETs with identity rotations.
    """
    root = file.joints[0]
    moved = [f"{axis}position" in root.channels for axis in "XYZ"]
    x, y, z = (own if has else 0.0 for own, has in zip(root.offset, moved, strict=True))
    rotations, translations = local_motion(file)
    evidence = f"frame time {file.frame_time:g} s"
    return MotionFile(
        file.source,
        "BVH",
        skeleton(file),
        rotations,
        translations,
        file.rate,
        evidence,
        added_offset=(x, y, z),
    )


def to_clip(file: BvhFile, *, metres_per_unit: float, up: UpAxis, root_offset: RootOffset) -> Clip:
    """Return the file's motion in metres with Y up, as `clip_conversion.to_clip`."""
    return clip_conversion.to_clip(
        motion_file(file), metres_per_unit=metres_per_unit, up=up, root_offset=root_offset
    )


def skeleton(file: BvhFile) -> Skeleton:
    """Return the joints and end sites at rest in the file's unit and axes."""
    return Skeleton(
        tuple(joint.name for joint in file.joints),
        tuple(joint.parent for joint in file.joints),
        np.array([joint.offset for joint in file.joints]),
        tuple(joint for joint, _ in file.tips),
        np.array([offset for _, offset in file.tips]).reshape(-1, 3),
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
