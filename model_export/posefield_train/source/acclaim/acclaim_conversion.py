"""Conversion of an Acclaim skeleton and motion to a clip.

A bone turns about axes of its own: with C for the rotation to these axes and M for the product of
its free angles, its rotation local to the parent is C M C⁻¹, with all axes parallel to the global
ones at rest. A joint of the clip stands where its bone begins, so that its offset is the bone of
its parent, and the bones at the ends become end sites.
"""

import numpy as np

from posefield.common.errors import AcclaimError
from posefield.common.units import Floats
from posefield.motion import clip, quat
from posefield.motion.clip import Clip
from posefield.motion.skeleton import Skeleton
from posefield_train.source.acclaim.amc_reader import AmcFile
from posefield_train.source.acclaim.asf_reader import ROOT, AsfBone, AsfFile


def to_clip(skeleton: AsfFile, motion: AmcFile, *, metres_per_unit: float, rate: float) -> Clip:
    """Return the motion in metres; the files' axes are kept, and Y is up in those of CMU and HDM05.

    Neither file states the frame rate, frames a second. Raises AcclaimError for a motion of another
    skeleton, ValueError for a unit that is not positive.
    """
    if not (np.isfinite(metres_per_unit) and metres_per_unit > 0):
        raise ValueError(f"metres_per_unit {metres_per_unit}, expected a positive number")
    moving = {bone.name for bone in skeleton.bones if bone.dof}
    if motion.angles.keys() != moving:
        other = sorted(motion.angles.keys() ^ moving)
        raise AcclaimError(motion.source, f"only it or {skeleton.source} has angles of {other}")
    root = quat.from_euler(np.deg2rad(motion.root[:, 5:2:-1]), "ZYX")
    turned = [root, *(_rotations(bone, motion) for bone in skeleton.bones)]
    joints = _joints(skeleton, metres_per_unit)
    path = metres_per_unit * motion.root[:, :3]
    return clip.assemble(joints, np.stack(turned, axis=1), path, joints.offsets, rate)


def _rotations(bone: AsfBone, motion: AmcFile) -> Floats:
    """Return the rotations (F, 4) of a bone local to its parent."""
    if not bone.dof:
        return np.tile(quat.IDENTITY, (len(motion), 1))
    own = quat.from_euler(np.deg2rad(np.array(bone.axis)[::-1]), "ZYX")
    free = quat.from_euler(np.deg2rad(motion.angles[bone.name][:, ::-1]), bone.dof[::-1])
    return quat.mul(quat.mul(own, free), quat.conj(own))


def _joints(skeleton: AsfFile, metres_per_unit: float) -> Skeleton:
    """Return the root and a joint at the start of each bone, m."""
    names = [ROOT, *(bone.name for bone in skeleton.bones)]
    vectors = {
        bone.name: metres_per_unit * bone.length * np.array(bone.direction)
        for bone in skeleton.bones
    }
    parents = [bone.parent for bone in skeleton.bones]
    leaves = [name for name in names[1:] if name not in parents]
    return Skeleton(
        tuple(names),
        (-1, *(names.index(parent) for parent in parents)),
        np.stack([np.zeros(3), *(vectors.get(parent, np.zeros(3)) for parent in parents)]),
        tuple(names.index(name) for name in leaves),
        np.stack([vectors[name] for name in leaves]),
    )
