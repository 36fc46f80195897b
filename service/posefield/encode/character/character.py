"""Character without motion: a skeleton in its rest pose and the body mesh skinned to it."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt

from posefield.common.units import Floats, Singles
from posefield.encode.character import body_mesh, joint_names
from posefield.encode.character import extent as reach
from posefield.encode.character.body_mesh import BoneBoxes, Bones
from posefield.encode.character.extent import PointTree
from posefield.encode.files import axis_conversion
from posefield.encode.files.file_convention import METRES, Convention
from posefield.motion.skeleton import Skeleton

CharacterArrays = Mapping[str, npt.NDArray[Any]]
"""Arrays of one character by name.

bind, rest: matrices (J, 4, 4). points, normals: (P, 3). extent: (2, 3).
"""


@dataclass(frozen=True, eq=False)
class CharacterRig:
    """Properties shared by all clips of a skeleton; compared by identity.

    names, paths: of the joints, the latter as in USD. tree: of joints and tips. bones: boxes of the
    body mesh.
    """

    skeleton: Skeleton
    names: tuple[str, ...]
    paths: tuple[str, ...]
    tree: PointTree
    bones: Bones


def rig(skeleton: Skeleton) -> CharacterRig:
    """Return the rig of a skeleton, cached: it takes milliseconds to build."""
    tips = skeleton.tip_offsets.tobytes()
    shape = (skeleton.offsets.tobytes(), skeleton.tip_joints, tips)
    return _cached_rig(_SkeletonKey((skeleton.names, skeleton.parents, *shape), skeleton))


class _SkeletonKey:
    """Skeleton as a cache key, compared by content: arrays cannot be compared or hashed."""

    def __init__(self, said: tuple[Any, ...], skeleton: Skeleton) -> None:
        self.said, self.skeleton = said, skeleton

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _SkeletonKey) and self.said == other.said

    def __hash__(self) -> int:
        return hash(self.said)


@lru_cache(maxsize=64)
def _cached_rig(key: _SkeletonKey) -> CharacterRig:
    joints = key.skeleton
    paths = joint_names.joint_paths(joint_names.legal_names(joints.names), joints.parents)
    return CharacterRig(joints, joints.names, paths, reach.tree(joints), body_mesh.bones(joints))


@dataclass(frozen=True)
class RestPose:
    """M characters of one rig in the rest pose.

    offsets: from the parents (M, J, 3), m. boxes: of their body meshes.
    """

    rig: CharacterRig
    offsets: Floats
    boxes: BoneBoxes


def rest_pose(rig: CharacterRig, offsets: Floats | Singles) -> RestPose:
    """Return characters with bone offsets (M, J, 3), m; each root is at the rig's root position."""
    rest = offsets.astype(np.float64)
    rest[:, 0] = rig.skeleton.offsets[0]
    return RestPose(rig, rest, body_mesh.bone_boxes(rig.skeleton, rig.bones, rest))


def character_arrays(rest: RestPose, convention: Convention) -> dict[str, npt.NDArray[Any]]:
    """Return the arrays (M, ...) of the characters, without their extents."""
    points, normals = body_mesh.points_and_normals(rest.boxes)
    points, normals = (
        axis_conversion.convert_positions(convention, points),
        axis_conversion.convert_directions(convention, normals),
    )
    bind = _translation_matrices(convention, rest.rig.skeleton.at_rest(rest.offsets))
    local = _translation_matrices(convention, rest.offsets)
    return {"bind": bind, "rest": local, "points": points, "normals": normals}


def bounding_radii(rest: RestPose) -> Floats:
    """Return radii (M, P), m, of spheres about joints and tips that bound the body mesh.

    Each box lies in the convex hull of the spheres about its two ends.
    """
    bones, found, (characters, joints, _) = rest.rig.bones, rest.boxes, rest.offsets.shape
    radii = np.zeros((characters, joints + len(rest.rig.tree.tips)))
    every = np.arange(characters)[:, None]
    count, near = len(bones.ends), found.radii.copy()
    # A stub is as high as it is wide.
    near[:, count:] *= np.sqrt(2.0)
    np.maximum.at(radii, (every, bones.joints), near)
    np.maximum.at(radii, (every, bones.ends), near[:, :count])
    return radii


def rest_pose_arrays(rig: CharacterRig, convention: Convention = METRES) -> CharacterArrays:
    """Return the arrays of the character in the skeleton's rest pose."""
    rest = rest_pose(rig, rig.skeleton.offsets[None])
    made = {name: array[0] for name, array in character_arrays(rest, convention).items()}
    places = np.concatenate([made["bind"][:, 3, :3], made["points"]])
    extent = reach.enlarged_box(places.min(axis=0), places.max(axis=0))
    return made | {"extent": extent.astype(np.float32)}


def _translation_matrices(convention: Convention, metres: Floats) -> Floats:
    """Return translation matrices (..., 4, 4) for row vectors, as in USD."""
    made = np.zeros((*metres.shape[:-1], 4, 4))
    made[...] = np.eye(4)
    made[..., 3, :3] = axis_conversion.rounded_lengths(
        convention, axis_conversion.convert_positions(convention, metres)
    )
    return made
