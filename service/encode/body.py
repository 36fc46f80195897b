"""A light body for a skeleton that has none: one tapered box a bone, skinned to one joint each.

Readers need it: some show nothing, and some find no bones, where a skeleton has no skinned mesh.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
import numpy.typing as npt

from service.motion.conventions import Floats
from service.motion.skeleton import Skeleton

Integers = npt.NDArray[np.int32]

# A box has an apex near the joint it turns with, two square rings, and an apex near the other
# joint. The apexes keep a little off the joints so that no two boxes share a point, and not by
# the same amount, so that boxes laid head to tail do not share one either.
ALONG = np.array([0.02, *[0.15] * 4, *[0.8] * 4, 0.99])
WIDTH = np.array([0.0, *[1.0] * 4, *[0.6] * 4, 0.0])
CORNERS = np.array([(0, 0), *[(1, 0), (0, 1), (-1, 0), (0, -1)] * 2, (0, 0)], dtype=float)
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
    """Boxes to draw: joints (B,) they turn with, starts and arms (B, 3) at rest, radii (B,), m."""

    joints: Integers
    starts: Floats
    arms: Floats
    radii: Floats


@dataclass(frozen=True)
class Body:
    """A mesh of boxes: points and normals (P, 3), and of each its joint and index of tint (P,)."""

    points: Floats
    normals: Floats
    tints: Integers
    joints: Integers
    face_counts: Integers
    face_points: Integers


def bones(skeleton: Skeleton, rest: Floats) -> Bones:
    """Boxes from joint to joint and to end sites, and stubs on joints where nothing follows.

    Bones of next to no length, and those that lie where another does, get none. rest (J, 3) are
    the joint positions of the rest pose, m.
    """
    size = float(np.max(np.ptp(rest, axis=0))) or 1.0
    owners = np.array([*skeleton.parents[1:], *skeleton.tip_joints], dtype=np.int32)
    ends = np.concatenate([rest[1:], rest[list(skeleton.tip_joints)] + skeleton.tip_offsets])
    arms = ends - rest[owners]
    lengths = np.linalg.norm(arms, axis=-1)
    drawn = lengths > SHORTEST * size
    radii = np.clip(THICKNESS * lengths, THINNEST * size, THICKEST * size)
    stubs = _bare(skeleton, owners[len(rest) - 1 :][drawn[len(rest) - 1 :]])
    up = np.broadcast_to([0.0, 2 * STUB * size, 0.0], (len(stubs), 3))
    return _distinct(
        np.concatenate([owners[drawn], stubs]),
        np.concatenate([rest[owners[drawn]], rest[stubs] - up / 2]),
        np.concatenate([arms[drawn], up]),
        np.concatenate([radii[drawn], np.full(len(stubs), STUB * size)]),
    )


def build(found: Bones, middle: float) -> Body:
    """Mesh of the boxes, tinted by the side of the plane x = middle they lie on (+x is left)."""
    direction = found.arms / np.linalg.norm(found.arms, axis=-1, keepdims=True)
    across = _across(direction)
    radial = np.einsum("pk,bkc->bpc", CORNERS, across)
    points = (
        found.starts[:, None]
        + ALONG[:, None] * found.arms[:, None]
        + (found.radii[:, None] * WIDTH)[..., None] * radial
    )
    radial[:, 0], radial[:, -1] = -direction, direction
    counts, corners = _topology(len(points))
    return Body(
        points=points.reshape(-1, 3),
        normals=radial.reshape(-1, 3),
        tints=np.repeat(_tints(found, middle), POINTS),
        joints=np.repeat(found.joints, POINTS),
        face_counts=counts,
        face_points=corners,
    )


def _bare(skeleton: Skeleton, tipped: Integers) -> Integers:
    followed = {*skeleton.parents[1:], *tipped.tolist()}
    return np.array([j for j in range(len(skeleton)) if j not in followed], dtype=np.int32)


def _distinct(joints: Integers, starts: Floats, arms: Floats, radii: Floats) -> Bones:
    places = np.round(np.concatenate([starts, arms], axis=-1), 5)
    _, first = np.unique(places, axis=0, return_index=True)
    kept = np.sort(first)
    return Bones(joints[kept], starts[kept], arms[kept], radii[kept])


def _across(direction: Floats) -> Floats:
    """Two unit vectors (B, 2, 3) square to each direction; all three are right-handed."""
    along_z = np.abs(direction[:, 2:]) > 0.9
    helper = np.where(along_z, [1.0, 0.0, 0.0], [0.0, 0.0, 1.0])
    first = np.cross(helper, direction)
    first /= np.linalg.norm(first, axis=-1, keepdims=True)
    return np.stack([first, np.cross(direction, first)], axis=1)


def _tints(found: Bones, middle: float) -> Integers:
    side = found.starts[:, 0] + found.arms[:, 0] / 2 - middle
    aside = np.abs(side) > found.radii / 2
    return np.where(aside, np.where(side > 0, 1, 2), 0).astype(np.int32)


@cache
def _topology(boxes: int) -> tuple[Integers, Integers]:
    counts = np.array([len(face) for face in FACES], dtype=np.int32)
    corners = np.array([point for face in FACES for point in face], dtype=np.int32)
    starts = np.arange(boxes, dtype=np.int32)[:, None] * POINTS
    return np.tile(counts, boxes), (starts + corners).reshape(-1)
