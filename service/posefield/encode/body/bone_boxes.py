"""Tapered boxes along the bones of a skeleton, one for each, which show its bones and sides."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from posefield.common.units import Floats, Singles
from posefield.encode.body.skinned_mesh import FULL_WEIGHT, SkinnedMesh, distinct_places
from posefield.motion import quat
from posefield.motion.skeleton import Skeleton

Integers = npt.NDArray[np.int32]

# A box has an apex near the joint it turns with, two square rings, and an apex near the other
# joint. The apexes keep a little off the joints so that no two boxes share a point, and not by
# the same amount, so that boxes laid head to tail do not share one either.
# Point, component and box: the boxes come last, for there are most of them.
RING_POSITIONS = np.array([0.02, *[0.15] * 4, *[0.8] * 4, 0.99], np.float32)[:, None, None]
RING_WIDTHS = np.array([0.0, *[1.0] * 4, *[0.6] * 4, 0.0], np.float32)[:, None, None]
RING_CORNERS = np.array([[0, *[1, 0, -1, 0] * 2, 0], [0, *[0, 1, 0, -1] * 2, 0]], np.float32)[
    ..., None, None
]
POINTS_PER_BOX = len(RING_POSITIONS)
SIDES = tuple((i, i % 4 + 1) for i in range(1, 5))
FACES: tuple[tuple[int, ...], ...] = (
    *((0, b, a) for a, b in SIDES),
    *((a, b, b + 4, a + 4) for a, b in SIDES),
    *((9, a + 4, b + 4) for a, b in SIDES),
)

# Shares of the skeleton's size: about 1 cm, 5 cm, 2 cm and 2 mm on a person.
THINNEST, THICKEST, STUB, SHORTEST = 0.006, 0.03, 0.012, 0.001
THICKNESS = 0.1
"""Half the width of a box as a share of its length, between THINNEST and THICKEST."""

# Centre, left, right: readers that support one colour per mesh use the first.
TINTS = np.array([(0.75, 0.75, 0.75), (0.25, 0.45, 0.85), (0.85, 0.4, 0.25)])


@dataclass(frozen=True)
class Bones:
    """K boxes of a body mesh.

    joints (K,): the joint that each box is skinned to. ends (L,): for the first L boxes the far
    end, an index of a joint or, after all joints, of a tip; the other boxes are stubs on leaf
    joints. tints (K,): index in TINTS.
    """

    joints: Integers
    ends: Integers
    tints: Integers


@dataclass(frozen=True)
class BoneBoxes:
    """Boxes in the rest pose.

    starts: near ends (..., K, 3), m. arms: vectors to the far ends (..., K, 3), m. radii: (..., K),
    m.
    """

    starts: Floats
    arms: Floats
    radii: Floats


def bones(skeleton: Skeleton) -> Bones:
    """Return boxes between joints and to end sites, and stubs on leaf joints.

    Bones shorter than a share of the skeleton's size and bones that coincide with another one have
    no box. A box on one side of the plane x of the root has the tint of that side: +x is left.
    """
    count = len(skeleton)
    owners = np.array([*skeleton.parents[1:], *skeleton.tip_joints], dtype=np.int32)
    ends = np.arange(1, len(owners) + 1, dtype=np.int32)
    every = bone_boxes(skeleton, Bones(owners, ends, owners), skeleton.offsets)
    size = _body_size(skeleton.at_rest(skeleton.offsets))
    drawn = np.linalg.norm(every.arms, axis=-1) > SHORTEST * size
    followed = {*skeleton.parents[1:], *owners[count - 1 :][drawn[count - 1 :]].tolist()}
    bare = np.array([j for j in range(count) if j not in followed], dtype=np.int32)
    found = Bones(np.concatenate([owners[drawn], bare]), ends[drawn], owners)
    return _distinct_bones(skeleton, found)


def bone_boxes(skeleton: Skeleton, bones: Bones, offsets: Floats) -> BoneBoxes:
    """Return the boxes for joints with rest offsets (..., J, 3) from their parents, m."""
    lead, stubs = offsets.shape[:-2], len(bones.joints) - len(bones.ends)
    tips = np.broadcast_to(skeleton.tip_offsets, (*lead, *skeleton.tip_offsets.shape))
    rest = skeleton.at_rest(offsets)
    size = _body_size(rest)[..., None]
    up = np.zeros((*lead, stubs, 3))
    up[..., 1] = 2 * STUB * size
    arms = np.concatenate([np.concatenate([offsets, tips], axis=-2)[..., bones.ends, :], up], -2)
    starts = rest[..., bones.joints, :]
    starts[..., len(bones.ends) :, :] -= up / 2
    radii = np.clip(THICKNESS * _lengths(arms), THINNEST * size, THICKEST * size)
    radii[..., len(bones.ends) :] = STUB * size
    return BoneBoxes(starts, arms, radii)


def points_and_normals(found: BoneBoxes) -> tuple[Singles, Singles]:
    """Return points and normals (..., 10 K, 3) of the boxes; those of zero length point up."""
    lengths = _lengths(found.arms)[..., None]
    up = np.array([0.0, 1.0, 0.0])
    direction = np.where(lengths > 0, found.arms / np.where(lengths > 0, lengths, 1.0), up)
    starts, arms, ahead, *across = map(
        _component_rows, (found.starts, found.arms, direction, *_orthogonal_vectors(direction))
    )
    radial = RING_CORNERS[0] * across[0] + RING_CORNERS[1] * across[1]
    points = (
        starts + RING_POSITIONS * arms + RING_WIDTHS * np.float32(found.radii.reshape(-1)) * radial
    )
    radial[0], radial[-1] = -ahead, ahead
    shape = (*found.radii.shape[:-1], -1, 3)
    return points.transpose(2, 0, 1).reshape(shape), radial.transpose(2, 0, 1).reshape(shape)


def faces(bones: Bones) -> tuple[Integers, Integers]:
    """Return the number of corners of each face, and the point index of each corner."""
    counts = np.array([len(face) for face in FACES], dtype=np.int32)
    corners = np.array([point for face in FACES for point in face], dtype=np.int32)
    starts = np.arange(len(bones.joints), dtype=np.int32)[:, None] * POINTS_PER_BOX
    return np.tile(counts, len(starts)), (starts + corners).reshape(-1)


def bones_body(skeleton: Skeleton) -> SkinnedMesh:
    """Return the boxes of a skeleton as a mesh whose points follow both ends of their bones."""
    found = bones(skeleton)
    boxes = bone_boxes(skeleton, found, skeleton.offsets)
    points, normals = points_and_normals(boxes)
    counts, corners = faces(found)
    ends = np.concatenate([found.ends, found.joints[len(found.ends) :]])
    anchors = np.repeat(np.stack([found.joints, ends], axis=-1), POINTS_PER_BOX, axis=0)
    joints = np.repeat(found.joints, POINTS_PER_BOX)[:, None]
    shares = np.tile(RING_POSITIONS.reshape(-1).astype(float), len(ends))
    return SkinnedMesh(
        np.ascontiguousarray(points, np.float32),
        np.ascontiguousarray(normals, np.float32),
        *distinct_places(anchors, shares),
        joints,
        np.full(joints.shape, FULL_WEIGHT, np.uint8),
        counts,
        corners,
        np.repeat(found.tints, POINTS_PER_BOX),
    )


def _body_size(rest: Floats) -> Floats:
    size = np.max(np.ptp(rest, axis=-2), axis=-1)
    return np.where(size > 0, size, 1.0)


def _component_rows(vectors: Floats) -> Singles:
    """Return the components (3, boxes) of vectors (..., 3)."""
    return np.ascontiguousarray(vectors.reshape(-1, 3).T, np.float32)


def _lengths(arms: Floats) -> Floats:
    x, y, z = arms[..., 0], arms[..., 1], arms[..., 2]
    return np.sqrt(x * x + y * y + z * z)


def _distinct_bones(skeleton: Skeleton, bones: Bones) -> Bones:
    """Return the boxes that do not coincide with an earlier one, with their tints."""
    found = bone_boxes(skeleton, bones, skeleton.offsets)
    places = np.round(np.concatenate([found.starts, found.arms], axis=-1), 5)
    _, first = np.unique(places, axis=0, return_index=True)
    kept = np.sort(first)
    tints = _tints(found, skeleton.offsets[0, 0])
    return Bones(bones.joints[kept], bones.ends[kept[kept < len(bones.ends)]], tints[kept])


def _orthogonal_vectors(direction: Floats) -> tuple[Floats, Floats]:
    """Return two unit vectors (..., 3) orthogonal to each direction; all three are right-handed."""
    along_z = np.abs(direction[..., 2:]) > 0.9
    helper = np.where(along_z, [1.0, 0.0, 0.0], [0.0, 0.0, 1.0])
    first = quat.cross(helper, direction)
    first /= _lengths(first)[..., None]
    return first, quat.cross(direction, first)


def _tints(found: BoneBoxes, middle: float) -> Integers:
    side = found.starts[:, 0] + found.arms[:, 0] / 2 - middle
    aside = np.abs(side) > found.radii / 2
    return np.where(aside, np.where(side > 0, 1, 2), 0).astype(np.int32)
