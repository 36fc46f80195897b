"""Character without motion, in the convention of a file: unit of length, up axis and body.

It is a skeleton in its rest pose and the body mesh skinned to it. For Z up the whole character is
rotated with the axes, including the joints' own axes, so that the rotations of the rest pose remain
the identity: (x, y, z) becomes (x, -z, y), which is exact. Numbers other than -0 never become -0.

With a colon, hyphen, space or leading digit in a joint name some readers of USD silently drop the
whole skeleton; readers that identify joints by their leaf name alone merge joints with equal names.
"""

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt

from posefield.common.units import Floats, LengthUnit, Singles, UpAxis
from posefield.encode import extent, skinned_mesh
from posefield.encode.extent import PointTree
from posefield.encode.mannequin import mannequin
from posefield.encode.skinned_mesh import BodyBounds, SkinnedMesh, bones_body
from posefield.motion import joint_roles, root_bone
from posefield.motion.clip import Clip
from posefield.motion.skeleton import Skeleton
from posefield.question.motion_question import DEFAULT_BODY, BodyKind

METRES_PER_UNIT: dict[LengthUnit, float] = {"m": 1.0, "cm": 0.01}


@dataclass(frozen=True)
class Convention:
    """Unit of length, as metres per unit, up axis, and kind of body of a file.

    Formats without a body take no notice of it. A character whose up axis is Z still faces its
    front: Y up, +Z ahead becomes Z up, -Y ahead.
    """

    metres_per_unit: float
    up: UpAxis
    body: BodyKind = DEFAULT_BODY


METRES = Convention(1.0, "y")
CENTIMETRES = Convention(0.01, "y")


Coordinates = TypeVar("Coordinates", Floats, Singles)

Z_UP_ORDER = [0, 2, 1]


def convert_positions(convention: Convention, metres: Coordinates) -> Coordinates:
    """Return positions or displacements (..., 3) in the unit and axes of a file.

    metres: with Y up.
    """
    unit = convention.metres_per_unit
    return convert_directions(convention, metres if unit == 1.0 else metres / unit)


def convert_directions(convention: Convention, along: Coordinates) -> Coordinates:
    """Return directions (..., 3) in the axes of a file.

    along: with Y up.
    """
    if convention.up == "y":
        return along
    return along[..., Z_UP_ORDER] * np.array([1, -1, 1], along.dtype) + along.dtype.type(0.0)


def convert_rotations(convention: Convention, turns: Singles) -> Singles:
    """Return quaternions (..., 4), real part last, in the axes of a file.

    turns: with Y up.
    """
    if convention.up == "y":
        return turns
    return turns[..., [*Z_UP_ORDER, 3]] * np.array([1, -1, 1, 1], turns.dtype) + turns.dtype.type(
        0.0
    )


def convert_clip(convention: Convention, clip: Clip) -> Clip:
    """Return the clip, with its skeleton, in the unit and axes of a file."""
    if convention == METRES:
        return clip
    joints, turns = clip.skeleton, clip.rotations
    offsets, tips = (convert_positions(convention, o) for o in (joints.offsets, joints.tip_offsets))
    turned = np.concatenate(
        [turns[..., :1], convert_directions(convention, turns[..., 1:])], axis=-1
    )
    return replace(
        clip,
        skeleton=replace(joints, offsets=offsets, tip_offsets=tips),
        rotations=turned,
        translations=convert_positions(convention, clip.translations),
    )


def convert_box(convention: Convention, corners: Floats) -> Floats:
    """Return the lowest and highest corner (..., 2, 3) of boxes in the unit and axes of a file.

    corners: m, with Y up.
    """
    return np.sort(convert_positions(convention, corners), axis=-2)


LEGAL_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")


def legal_names(names: Iterable[str]) -> tuple[str, ...]:
    """Return unique legal names in the given order; legal names are kept."""
    return joint_roles.clean_names(names, _legal_characters)


def joint_paths(leaves: Sequence[str], parents: Sequence[int]) -> tuple[str, ...]:
    """Return the joint tokens of UsdSkel: names of ancestors and joint, separated by slashes."""
    paths: list[str] = []
    for leaf, parent in zip(leaves, parents, strict=True):
        paths.append(leaf if parent < 0 else f"{paths[parent]}/{leaf}")
    return tuple(paths)


def _legal_characters(name: str) -> str:
    cleaned = re.sub(r"[^A-Za-z0-9_]", "_", name)
    return cleaned if LEGAL_NAME.fullmatch(cleaned) else f"_{cleaned}"


CharacterArrays = Mapping[str, npt.NDArray[Any]]
"""Arrays of one character by name.

bind, rest: matrices (J, 4, 4). points: (P, 3), if it has a body. extent: (2, 3).
"""


@dataclass(frozen=True, eq=False)
class CharacterRig:
    """Properties shared by all clips of a skeleton with one kind of body; compared by identity.

    names, paths: of the joints, the latter as in USD. tree: of joints and tips. body: the mesh, for
    the skeleton's own bones; None for none. bounds: what bounds it in any pose. hips: 1 below a
    root bone, else 0.
    """

    skeleton: Skeleton
    names: tuple[str, ...]
    paths: tuple[str, ...]
    tree: PointTree
    body: SkinnedMesh | None
    bounds: BodyBounds
    hips: int = 0


def rig(skeleton: Skeleton, body: BodyKind = DEFAULT_BODY, has_root: bool = False) -> CharacterRig:
    """Return the rig of a skeleton, cached: it takes up to a tenth of a second to build.

    has_root: whether the rig has a root bone above the skeleton.
    """
    shape = skeleton.names, skeleton.parents, skeleton.tip_joints
    arrays = skeleton.offsets.tobytes(), skeleton.tip_offsets.tobytes()
    return _cached_rig(*shape, *arrays, body, has_root)


def rig_and_clip(clip: Clip, body: BodyKind) -> tuple[CharacterRig, Clip]:
    """Return the rig and the motion of a clip as files have them: with its root bone, if any."""
    character_rig = rig(clip.skeleton, body, clip.root_bone)
    return character_rig, root_bone.add_root(
        clip, character_rig.skeleton
    ) if clip.root_bone else clip


def body_size(skeleton: Skeleton, body: BodyKind) -> int:
    """Return the number of points of a skeleton's body."""
    mesh = rig(skeleton, body).body
    return 0 if mesh is None else len(mesh.points)


@lru_cache(maxsize=64)
def _cached_rig(
    names: tuple[str, ...], parents: tuple[int, ...], owners: tuple[int, ...],
    arms: bytes, tips: bytes, kind: BodyKind, has_root: bool,
) -> CharacterRig:  # fmt: skip
    offsets, tip_offsets = (np.frombuffer(content).reshape(-1, 3) for content in (arms, tips))
    joints = Skeleton(names, parents, offsets, owners, tip_offsets)
    body = _mesh(joints, kind)
    if has_root:
        joints, body = root_bone.with_root(joints), body and skinned_mesh.below_root(body)
    paths = joint_paths(legal_names(joints.names), joints.parents)
    tree, bounds = extent.tree(joints), skinned_mesh.body_bounds(joints, body)
    return CharacterRig(joints, joints.names, paths, tree, body, bounds, int(has_root))


def _mesh(skeleton: Skeleton, kind: BodyKind) -> SkinnedMesh | None:
    if kind == "none":
        return None
    return (mannequin(skeleton) if kind == "mannequin" else None) or bones_body(skeleton)


class RestPose(NamedTuple):
    """M characters of one rig in the rest pose.

    offsets: from the parents (M, J, 3), m. points: of their body meshes (M, P, 3), m, without
    points if they have none. radii (M, J + E): of spheres about joints and tips, m; in any pose the
    body lies in the convex hull of those about the ends of each bone.
    """

    rig: CharacterRig
    offsets: Floats
    points: Singles
    radii: Floats


def rest_pose(rig: CharacterRig, offsets: Floats | Singles) -> RestPose:
    """Return characters with bone offsets (M, J, 3), m; all stand as low as the rig does."""
    rest = offsets.astype(np.float64)
    rest[:, : rig.hips + 1] = rig.skeleton.offsets[: rig.hips + 1]
    lowest = _lowest(rig, rig.skeleton.offsets)
    rest[:, rig.hips, 1] += lowest - _lowest(rig, rest)
    if rig.body is None:
        none = np.zeros((len(rest), len(rig.tree.order)))
        return RestPose(rig, rest, np.empty((len(rest), 0, 3), np.float32), none)
    displacements = rig.bounds.displacements(rest)
    along = rig.body.bone_places.displacements(displacements)
    return RestPose(rig, rest, rig.body.points_at(along), rig.bounds.radii(displacements, along))


def _lowest(rig: CharacterRig, offsets: Floats) -> Floats:
    """Return the height (...) of the lowest joint or tip at rest with offsets (..., J, 3), m."""
    heights = rig.skeleton.at_rest(offsets)[..., 1]
    tips = heights[..., list(rig.skeleton.tip_joints)] + rig.skeleton.tip_offsets[:, 1]
    return np.concatenate([heights[..., rig.hips :], tips], axis=-1).min(axis=-1)


def character_arrays(rest: RestPose, convention: Convention) -> dict[str, npt.NDArray[Any]]:
    """Return the arrays (M, ...) of the characters, without their extents."""
    bind = _translation_matrices(convention, rest.rig.skeleton.at_rest(rest.offsets))
    local = _translation_matrices(convention, rest.offsets)
    arrays: dict[str, npt.NDArray[Any]] = {"bind": bind, "rest": local}
    if rest.rig.body is not None:
        points = convert_positions(convention, rest.points)
        arrays["points"] = points
    return arrays


def rest_pose_arrays(rig: CharacterRig, convention: Convention = METRES) -> CharacterArrays:
    """Return the arrays of the character in the skeleton's rest pose."""
    rest = rest_pose(rig, rig.skeleton.offsets[None])
    arrays = {name: array[0] for name, array in character_arrays(rest, convention).items()}
    joint_positions = arrays["bind"][:, 3, :3]
    if "points" in arrays:
        joint_positions = np.concatenate([joint_positions, arrays["points"]])
    box = extent.enlarged_box(joint_positions.min(axis=0), joint_positions.max(axis=0))
    return arrays | {"extent": box.astype(np.float32)}


def _translation_matrices(convention: Convention, metres: Floats) -> Floats:
    """Return translation matrices (..., 4, 4) for row vectors, as in USD."""
    matrices = np.zeros((*metres.shape[:-1], 4, 4))
    matrices[...] = np.eye(4)
    # To a tenth of a micrometre: short as decimals, and still near their float32 values.
    decimals = 7 + math.floor(math.log10(convention.metres_per_unit))
    matrices[..., 3, :3] = convert_positions(convention, metres).round(decimals) + 0.0
    return matrices
