"""A light body for a skeleton that has none: one tapered box a bone, skinned to one joint each.

Readers need it: some show nothing, and some find no bones, where a skeleton has no skinned mesh.
Which boxes there are is up to the skeleton alone, so that all clips of a model have one topology;
where their points are follows the bones of a clip.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from service.motion import quat
from service.motion.conventions import Floats, Singles
from service.motion.skeleton import Skeleton

Integers = npt.NDArray[np.int32]

# A box has an apex near the joint it turns with, two square rings, and an apex near the other
# joint. The apexes keep a little off the joints so that no two boxes share a point, and not by
# the same amount, so that boxes laid head to tail do not share one either.
# Point, component and box: the boxes come last, for there are most of them.
ALONG = np.array([0.02, *[0.15] * 4, *[0.8] * 4, 0.99], np.float32)[:, None, None]
WIDTH = np.array([0.0, *[1.0] * 4, *[0.6] * 4, 0.0], np.float32)[:, None, None]
CORNERS = np.array([[0, *[1, 0, -1, 0] * 2, 0], [0, *[0, 1, 0, -1] * 2, 0]], np.float32)[
    ..., None, None
]
POINTS = len(ALONG)
SIDES = tuple((i, i % 4 + 1) for i in range(1, 5))
FACES: tuple[tuple[int, ...], ...] = (
    *((0, b, a) for a, b in SIDES),
    *((a, b, b + 4, a + 4) for a, b in SIDES),
    *((9, a + 4, b + 4) for a, b in SIDES),
)

# Shares of the skeleton's size: about 1 cm, 5 cm, 2 cm and 2 mm on a person.
THINNEST, THICKEST, STUB, SHORTEST = 0.006, 0.03, 0.012, 0.001
THICKNESS = 0.1
"""Half the width of a box as a share of its length, within THINNEST and THICKEST."""

# Centre, left, right: readers that know one colour a mesh take the first.
TINTS = np.array([(0.75, 0.75, 0.75), (0.25, 0.45, 0.85), (0.85, 0.4, 0.25)])


@dataclass(frozen=True)
class Bones:
    """The K boxes to draw: joints (K,) that they turn with, and tints (K,) by index.

    ends (L,): where the first L of them lead, as an index of joint or, past the joints, of tip;
    the others are stubs on joints where nothing follows.
    """

    joints: Integers
    ends: Integers
    tints: Integers


@dataclass(frozen=True)
class Boxes:
    """Where boxes are at rest: starts and arms (..., K, 3) and radii (..., K), m."""

    starts: Floats
    arms: Floats
    radii: Floats


def bones(skeleton: Skeleton) -> Bones:
    """Boxes from joint to joint and to end sites, and stubs on joints where nothing follows.

    Bones of next to no length at the skeleton's own rest, and those that lie where another does,
    get none. A box on one side of the plane x of the root is tinted by it: +x is left.
    """
    count = len(skeleton)
    owners = np.array([*skeleton.parents[1:], *skeleton.tip_joints], dtype=np.int32)
    ends = np.arange(1, len(owners) + 1, dtype=np.int32)
    every = boxes(skeleton, Bones(owners, ends, owners), skeleton.offsets)
    size = _size(skeleton.at_rest(skeleton.offsets))
    drawn = np.linalg.norm(every.arms, axis=-1) > SHORTEST * size
    followed = {*skeleton.parents[1:], *owners[count - 1 :][drawn[count - 1 :]].tolist()}
    bare = np.array([j for j in range(count) if j not in followed], dtype=np.int32)
    found = Bones(np.concatenate([owners[drawn], bare]), ends[drawn], owners)
    return _distinct(skeleton, found)


def boxes(skeleton: Skeleton, bones: Bones, offsets: Floats) -> Boxes:
    """Where the boxes are if the joints rest at offsets (..., J, 3) from their parents, m."""
    lead, stubs = offsets.shape[:-2], len(bones.joints) - len(bones.ends)
    tips = np.broadcast_to(skeleton.tip_offsets, (*lead, *skeleton.tip_offsets.shape))
    rest = skeleton.at_rest(offsets)
    size = _size(rest)[..., None]
    up = np.zeros((*lead, stubs, 3))
    up[..., 1] = 2 * STUB * size
    arms = np.concatenate([np.concatenate([offsets, tips], axis=-2)[..., bones.ends, :], up], -2)
    starts = rest[..., bones.joints, :]
    starts[..., len(bones.ends) :, :] -= up / 2
    radii = np.clip(THICKNESS * _lengths(arms), THINNEST * size, THICKEST * size)
    radii[..., len(bones.ends) :] = STUB * size
    return Boxes(starts, arms, radii)


def mesh(found: Boxes) -> tuple[Singles, Singles]:
    """Points and normals (..., 10 K, 3) of the boxes; a box without length looks upwards."""
    lengths = _lengths(found.arms)[..., None]
    up = np.array([0.0, 1.0, 0.0])
    direction = np.where(lengths > 0, found.arms / np.where(lengths > 0, lengths, 1.0), up)
    starts, arms, ahead, *across = map(
        _rows, (found.starts, found.arms, direction, *_across(direction))
    )
    radial = CORNERS[0] * across[0] + CORNERS[1] * across[1]
    points = starts + ALONG * arms + WIDTH * np.float32(found.radii.reshape(-1)) * radial
    radial[0], radial[-1] = -ahead, ahead
    shape = (*found.radii.shape[:-1], -1, 3)
    return points.transpose(2, 0, 1).reshape(shape), radial.transpose(2, 0, 1).reshape(shape)


def faces(bones: Bones) -> tuple[Integers, Integers]:
    """How many corners each face has, and the points that they are."""
    counts = np.array([len(face) for face in FACES], dtype=np.int32)
    corners = np.array([point for face in FACES for point in face], dtype=np.int32)
    starts = np.arange(len(bones.joints), dtype=np.int32)[:, None] * POINTS
    return np.tile(counts, len(starts)), (starts + corners).reshape(-1)


def _size(rest: Floats) -> Floats:
    size = np.max(np.ptp(rest, axis=-2), axis=-1)
    return np.where(size > 0, size, 1.0)


def _rows(vectors: Floats) -> Singles:
    """Components (3, boxes) of vectors (..., 3)."""
    return np.ascontiguousarray(vectors.reshape(-1, 3).T, np.float32)


def _lengths(arms: Floats) -> Floats:
    x, y, z = arms[..., 0], arms[..., 1], arms[..., 2]
    return np.sqrt(x * x + y * y + z * z)


def _distinct(skeleton: Skeleton, bones: Bones) -> Bones:
    """Those that lie where no earlier one does, with their tints."""
    found = boxes(skeleton, bones, skeleton.offsets)
    places = np.round(np.concatenate([found.starts, found.arms], axis=-1), 5)
    _, first = np.unique(places, axis=0, return_index=True)
    kept = np.sort(first)
    tints = _tints(found, skeleton.offsets[0, 0])
    return Bones(bones.joints[kept], bones.ends[kept[kept < len(bones.ends)]], tints[kept])


def _across(direction: Floats) -> tuple[Floats, Floats]:
    """Two unit vectors (..., 3) square to each direction; all three are right-handed."""
    along_z = np.abs(direction[..., 2:]) > 0.9
    helper = np.where(along_z, [1.0, 0.0, 0.0], [0.0, 0.0, 1.0])
    first = quat.cross(helper, direction)
    first /= _lengths(first)[..., None]
    return first, quat.cross(direction, first)


def _tints(found: Boxes, middle: float) -> Integers:
    side = found.starts[:, 0] + found.arms[:, 0] / 2 - middle
    aside = np.abs(side) > found.radii / 2
    return np.where(aside, np.where(side > 0, 1, 2), 0).astype(np.int32)
