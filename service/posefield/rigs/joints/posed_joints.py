"""Skeletons whose rest pose has rotations, turned to one whose rest rotations are the identity.

USD and glTF store a rotation of every joint at rest; BVH and this project's models do not. With R
for the orientation of a joint at rest, and P for that of its parent, in the file's world, a local
rotation Q becomes P Q R⁻¹ and a local translation t becomes P t: every joint stays where it is, and
bones of the rest pose keep their directions.
"""

from dataclasses import dataclass, replace

import numpy as np

from posefield.common.array_shapes import Bones, Positions, Rotations
from posefield.common.errors import MotionFileError
from posefield.common.units import Floats
from posefield.motion import quat
from posefield.motion.skeleton import Skeleton

SCALE_TOLERANCE = 2e-3
"""Largest relative change of a scale that is rounding: USD stores scales in half precision."""


@dataclass(frozen=True)
class PosedJoints:
    """Joints of a file with their rest pose, parents first, and their motion.

    names, parents: as in a skeleton. rest_rotations (J, 4), rest_translations (J, 3): local to the
    parent at rest. rotations (F, J, 4), translations (F, J, 3), scales (F, J, 3): local to the
    parent in the motion. Those of the root are in the file's world.
    """

    source: str
    names: tuple[str, ...]
    parents: tuple[int, ...]
    rest_rotations: Floats
    rest_translations: Bones
    rotations: Rotations
    translations: Positions
    scales: Positions


@dataclass(frozen=True)
class PlainMotion:
    """A skeleton at rest with identity rotations, and its motion, as in a MotionFile."""

    skeleton: Skeleton
    rotations: Rotations
    translations: Positions


def plain_motion(joints: PosedJoints) -> PlainMotion:
    """Return the joints at rest with identity rotations and without scale.

    Raises MotionFileError for a scale that is animated, uneven or mirrored.
    """
    sizes = _constant_scales(joints)
    above = _products(joints.parents, sizes)
    own = replace(joints, rotations=quat.normalize(joints.rotations))
    turns = _rest_orientations(joints)
    parents = np.array(joints.parents)
    outer = np.concatenate([quat.IDENTITY[None], turns[parents[1:]]])
    rotations = quat.mul(quat.mul(outer, own.rotations), quat.conj(turns))
    translations = quat.rotate(outer, above[:, None] * own.translations)
    offsets = quat.rotate(outer, above[:, None] * own.rest_translations)
    skeleton = Skeleton(joints.names, joints.parents, offsets, (), np.zeros((0, 3)))
    return PlainMotion(skeleton, rotations, translations)


def _rest_orientations(joints: PosedJoints) -> Floats:
    """Return the orientations (J, 4) of the joints at rest in the file's world."""
    turns = quat.normalize(joints.rest_rotations)
    for joint, parent in enumerate(joints.parents[1:], start=1):
        turns[joint] = quat.normalize(quat.mul(turns[parent], turns[joint]))
    return turns


def _constant_scales(joints: PosedJoints) -> Floats:
    """Return the scale (J,) of each joint; MotionFileError if it is not constant and even."""
    scales = joints.scales
    usual = scales[0].mean(axis=-1)
    apart = np.abs(scales - usual[:, None]).max(axis=(0, 2))
    odd = np.flatnonzero(~(apart <= SCALE_TOLERANCE * np.abs(usual)) | (usual <= 0.0))
    if len(odd):
        joint = int(odd[0])
        low, high = scales[:, joint].min(), scales[:, joint].max()
        raise MotionFileError(
            joints.source,
            f"joint {joints.names[joint]!r} has scales from {low:.4g} to {high:.4g}, expected one "
            "positive scale along all axes in all frames: bake the scale into the bones",
        )
    # Scales of 1 in half precision, or of rounded matrices, are 1.
    return np.where(np.abs(usual - 1.0) <= SCALE_TOLERANCE, 1.0, usual)


def _products(parents: tuple[int, ...], sizes: Floats) -> Floats:
    """Return the product (J,) of the scales of each joint's ancestors."""
    above = np.ones(len(sizes))
    for joint, parent in enumerate(parents[1:], start=1):
        above[joint] = above[parent] * sizes[parent]
    return above
