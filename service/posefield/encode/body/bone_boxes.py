"""Tapered boxes along the bones of a skeleton, one for each, which show its bones and sides."""

import numpy as np

from posefield.common.units import Floats, Singles
from posefield.encode.body import skinned_mesh
from posefield.encode.body.skinned_mesh import FULL_WEIGHT, SkinnedMesh
from posefield.motion import quat
from posefield.motion.skeleton import Skeleton

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


def bones_body(skeleton: Skeleton) -> SkinnedMesh:
    """Return the boxes of a skeleton as a mesh whose points follow both ends of their bones.

    There is a box between joints and to end sites, and a stub on each leaf joint. Bones shorter
    than a share of the skeleton's size and bones that coincide with another one have no box. A box
    on one side of the plane x of the root has the tint of that side: +x is left.
    """
    rest = skeleton.at_rest(skeleton.offsets)
    size = float(np.max(np.ptp(rest, axis=0))) or 1.0
    count = len(skeleton)
    joints = np.array([*skeleton.parents[1:], *skeleton.tip_joints], np.int32)
    ends = np.arange(1, len(joints) + 1, dtype=np.int32)
    arms = np.concatenate([skeleton.offsets[1:], skeleton.tip_offsets])
    drawn = _lengths(arms) > SHORTEST * size
    followed = {*skeleton.parents[1:], *joints[count - 1 :][drawn[count - 1 :]].tolist()}
    stubs = np.array([joint for joint in range(count) if joint not in followed], np.int32)
    joints, ends = np.append(joints[drawn], stubs), np.append(ends[drawn], stubs)
    up = np.tile([0.0, 2 * STUB * size, 0.0], (len(stubs), 1))
    arms = np.concatenate([arms[drawn], up])
    starts = rest[joints]
    starts[len(starts) - len(stubs) :] -= up / 2
    radii = np.clip(THICKNESS * _lengths(arms), THINNEST * size, THICKEST * size)
    radii[len(radii) - len(stubs) :] = STUB * size
    # Of boxes that coincide the first is drawn.
    rows = np.round(np.concatenate([starts, arms], axis=-1), 5)
    kept = np.sort(np.unique(rows, axis=0, return_index=True)[1])
    joints, ends, starts, arms, radii = (
        joints[kept],
        ends[kept],
        starts[kept],
        arms[kept],
        radii[kept],
    )
    side = starts[:, 0] + arms[:, 0] / 2 - skeleton.offsets[0, 0]
    tints = np.where(np.abs(side) > radii / 2, np.where(side > 0, 1, 2), 0).astype(np.int32)
    points, normals = _points_and_normals(starts, arms, radii)
    counts = np.tile(np.array([len(face) for face in FACES], np.int32), len(joints))
    corners = np.array([point for face in FACES for point in face], np.int32)
    first = np.arange(len(joints), dtype=np.int32)[:, None] * POINTS_PER_BOX
    corners = (first + corners).reshape(-1)
    movers = np.repeat(joints, POINTS_PER_BOX)[:, None]
    return SkinnedMesh(
        points,
        normals,
        *skinned_mesh.distinct_places(
            np.repeat(np.stack([joints, ends], axis=-1), POINTS_PER_BOX, axis=0),
            np.tile(RING_POSITIONS.reshape(-1).astype(float), len(ends)),
        ),
        movers,
        np.full(movers.shape, FULL_WEIGHT, np.uint8),
        counts,
        corners,
        np.repeat(tints, POINTS_PER_BOX),
        skinned_mesh.triangles(counts, corners),
    )


def _points_and_normals(starts: Floats, arms: Floats, radii: Floats) -> tuple[Singles, Singles]:
    """Return points and normals (10 K, 3) of K boxes from near to far ends, m."""
    direction = arms / _lengths(arms)[:, None]
    helper = np.where(np.abs(direction[:, 2:]) > 0.9, [1.0, 0.0, 0.0], [0.0, 0.0, 1.0])
    first = quat.cross(helper, direction)
    first /= _lengths(first)[:, None]
    rows = (starts, arms, direction, first, quat.cross(direction, first))
    start, arm, ahead, *across = (np.ascontiguousarray(a.T, np.float32) for a in rows)
    radial = RING_CORNERS[0] * across[0] + RING_CORNERS[1] * across[1]
    points = start + RING_POSITIONS * arm + RING_WIDTHS * np.float32(radii) * radial
    radial[0], radial[-1] = -ahead, ahead
    points, normals = (a.transpose(2, 0, 1).reshape(-1, 3) for a in (points, radial))
    return np.ascontiguousarray(points, np.float32), np.ascontiguousarray(normals, np.float32)


def _lengths(arms: Floats) -> Floats:
    x, y, z = arms[..., 0], arms[..., 1], arms[..., 2]
    return np.sqrt(x * x + y * y + z * z)
