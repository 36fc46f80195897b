"""Body meshes skinned to a skeleton, which follow the bone lengths of each clip; their bounds.

The plain body is one tapered box along each bone, which shows the bones and their sides.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from posefield.common.units import Floats, Indices, Singles
from posefield.motion import quat
from posefield.motion.skeleton import Skeleton

Integers = npt.NDArray[np.int32]
Bytes = npt.NDArray[np.uint8]

SKIN, ROUGHNESS = (0.62, 0.64, 0.69), 0.6
"""Colour and roughness of a body's material."""
# Centre, left, right: readers that support one colour per mesh use the first.
TINTS = np.array([(0.75, 0.75, 0.75), (0.25, 0.45, 0.85), (0.85, 0.4, 0.25)])
FULL_WEIGHT = 255
"""Sum of the weights of a point, which are whole numbers, so that they fit a byte in glTF."""


@dataclass(frozen=True)
class BonePlaces:
    """R places along bones, which follow their ends.

    anchors (R, 2): two joints or, after all joints, tips. shares (R,): a place moves by (1 - share)
    of the displacement of its first anchor and share of its second's.
    """

    anchors: Integers
    shares: Floats

    def displacements(self, displaced: Floats) -> Floats:
        """Return how far (M, R, 3) the places move, m, with anchors moved by (M, J + E, 3)."""
        first, second = (displaced.take(self.anchors[:, end], axis=1) for end in (0, 1))
        second -= first
        second *= self.shares[:, None]
        first += second
        return first


@dataclass(frozen=True)
class SkinnedMesh:
    """P points, with normals, faces and weights, about a skeleton of J joints and E tips at rest.

    points (P, 3): m. normals (P, 3): unit, outward. bone_places: along bones; place_of_point (P,):
    the one that each point moves with where bones are longer or shorter. joints, weights (P, I):
    the joints that move each point, and their weights out of FULL_WEIGHT; points with fewer of them
    have zeros. counts: corners of each face; corners: their points, counterclockwise from outside.
    tints (P,): index of the point's colour. coarse (T, 3): fewer triangles on the same points, for
    characters seen from afar.
    """

    points: Singles
    normals: Singles
    bone_places: BonePlaces
    place_of_point: Integers
    joints: Integers
    weights: Bytes
    counts: Integers
    corners: Integers
    tints: Integers
    coarse: Integers

    def points_at(self, displaced: Floats) -> Singles:
        """Return the points (M, P, 3), m, for places that move by (M, R, 3), m."""
        points = displaced.astype(np.float32).take(self.place_of_point, axis=1)
        points += self.points
        return points


def below_root(mesh: SkinnedMesh) -> SkinnedMesh:
    """Return the mesh for a skeleton with another joint before all others."""
    bone_places = replace(mesh.bone_places, anchors=mesh.bone_places.anchors + 1)
    return replace(mesh, bone_places=bone_places, joints=mesh.joints + 1)


def colours(mesh: SkinnedMesh) -> Singles:
    """Return the colours (C, 3) that the tints of a mesh stand for: one for all, or three."""
    tints = TINTS if mesh.tints.any() else np.array([SKIN])
    return tints.astype(np.float32)


def distinct_places(anchors: Integers, shares: Floats) -> tuple[BonePlaces, Integers]:
    """Return the distinct places of points, and the index (P,) of each point's."""
    rows = np.concatenate([anchors, shares[:, None]], axis=1)
    distinct, index = np.unique(rows, axis=0, return_inverse=True)
    bone_places = BonePlaces(distinct[:, :2].astype(np.int32), distinct[:, 2].copy())
    return bone_places, index.reshape(-1).astype(np.int32)


def triangles(counts: Integers, corners: Integers) -> Integers:
    """Return the corners (T, 3) of faces cut into triangle fans."""
    cut = counts - 2
    face = np.repeat(np.arange(len(cut)), cut)
    first = (np.cumsum(counts) - counts)[face]
    turn = np.arange(len(face)) - (np.cumsum(cut) - cut)[face]
    return corners[np.stack([first, first + turn + 1, first + turn + 2], axis=-1)]


def vertex_normals(points: Floats, faces: Integers) -> Singles:
    """Return unit normals (P, 3): the mean of the triangles (T, 3) at a point, by their areas."""
    a, b, c = (points[faces[:, corner]] for corner in range(3))
    areas = np.cross(b - a, c - a)
    normals = np.zeros_like(points)
    for corner in range(3):
        np.add.at(normals, faces[:, corner], areas)
    lengths = np.linalg.norm(normals, axis=-1, keepdims=True)
    up = np.array([0.0, 1.0, 0.0])
    return np.where(lengths > 0, normals / np.where(lengths > 0, lengths, 1.0), up).astype(
        np.float32
    )


@dataclass(frozen=True)
class BodyBounds:
    """Points of a body in K groups, of which each is moved by one joint and near to one bone.

    A joint moves a point rigidly, with its own bones: so in any pose the point stays as far from a
    place along such a bone as at rest. A point that several joints move is the mean, by its
    weights, of the points to which each would move it; so it is as far from the mean of those
    places as the mean of those distances, at most. The body is therefore within the convex hull of
    spheres about the ends of bones, whose radius is the largest such mean of the points near to
    each.

    joints, bone_ends (K,): the joint, and where the bone that is near leads; the joint itself where
    none is nearer. place_of_group (K,): the place among those of the body that the points of a
    group follow. lowest, highest (K,): shares of the way along the bone between which the points
    lie. rest (K,): largest mean distance of the points from their bones at rest, m.
    """

    skeleton: Skeleton
    joints: Indices
    bone_ends: Indices
    place_of_group: Indices
    lowest: Floats
    highest: Floats
    rest: Floats

    def displacements(self, offsets: Floats) -> Floats:
        """Return how far bone offsets (M, J, 3) move joints and tips (M, J + E, 3) at rest, m."""
        joints = self.skeleton
        displaced = joints.at_rest(offsets - joints.offsets)
        return np.concatenate([displaced, displaced.take(joints.tip_joints, axis=1)], axis=1)

    def radii(self, displaced: Floats, along: Floats) -> Floats:
        """Return the radii (M, J + E), m, of bodies made for bones of other lengths.

        displaced: displacements of joints and tips (M, J + E, 3), m; along: of the body's places
        (M, R, 3), m. A point and the place on the bone next to it move by different displacements,
        which are linear in the share along the bone; so the largest difference is at one end.
        """
        start, end = displaced.take(self.joints, axis=1), displaced.take(self.bone_ends, axis=1)
        end -= start
        start -= along.take(self.place_of_group, axis=1)
        low, high = (start + share[:, None] * end for share in (self.lowest, self.highest))
        return self._spheres(np.maximum(_lengths(low), _lengths(high)))

    def radii_of_others(self, offsets: Floats | Singles) -> Floats:
        """Return the radii (M, J + E), m, where bone offsets (M, J, 3) move a body made at rest."""
        tips = np.zeros((len(offsets), len(self.skeleton.tip_joints), 3))
        longer = np.concatenate([offsets - self.skeleton.offsets, tips], axis=1)
        arms = longer.take(self.bone_ends, axis=1)
        arms[:, self.bone_ends == self.joints] = 0.0
        return self._spheres(self.highest * _lengths(arms))

    @cached_property
    def _groups_of_points(self) -> list[tuple[Indices, Indices, Indices]]:
        """Return, for each end of the bones, the groups in the order of its points (K,).

        With the points (P,), and the place in that order of each one's first group (P,).
        """
        groups = []
        for indices in (self.joints, self.bone_ends):
            order = np.argsort(indices, kind="stable")
            groups.append((order, *np.unique(indices[order], return_index=True)))
        return groups

    def _spheres(self, differences: Floats) -> Floats:
        """Return the radius (M, J + E) about each joint and tip.

        differences (M, K): by how much the points of each group may be further away than at rest,
        m. A point may belong to several groups, so the largest counts for all.
        """
        radii_of_points = np.zeros(
            (len(differences), len(self.skeleton) + len(self.skeleton.tip_joints))
        )
        if not len(self.joints):
            return radii_of_points
        radii = self.rest + differences.max(axis=1, keepdims=True)
        for order, points, firsts in self._groups_of_points:
            largest = np.maximum.reduceat(radii.take(order, axis=1), firsts, axis=1)
            radii_of_points[:, points] = np.maximum(radii_of_points[:, points], largest)
        return radii_of_points


def body_bounds(skeleton: Skeleton, body: SkinnedMesh | None) -> BodyBounds:
    """Return the bounds of a body; None for no body."""
    if body is None:
        none = np.empty(0, np.intp)
        share = np.empty(0)
        return BodyBounds(skeleton, none, none, none, share, share, share)
    points, influences = np.nonzero(body.weights)
    joints = body.joints[points, influences].astype(np.intp)
    tips, shares, distances = _nearest_bones(skeleton, body.points[points].astype(float), joints)
    means = np.zeros(len(body.points))
    np.add.at(means, points, distances * body.weights[points, influences] / FULL_WEIGHT)
    distances = means[points]
    keys = np.stack([joints, tips, body.place_of_point[points]])
    order = np.lexsort(keys)
    keys, shares, distances = keys[:, order], shares[order], distances[order]
    is_first = np.concatenate([[True], np.any(np.diff(keys) != 0, axis=0)])
    firsts = np.flatnonzero(is_first)
    joints, tips, groups = keys[:, firsts]
    return BodyBounds(
        skeleton,
        joints,
        tips,
        groups,
        np.minimum.reduceat(shares, firsts),
        np.maximum.reduceat(shares, firsts),
        np.maximum.reduceat(distances, firsts),
    )


def _nearest_bones(
    skeleton: Skeleton, points: Floats, joints: Indices
) -> tuple[Indices, Floats, Floats]:
    """Return, of points (K, 3) moved by joints (K,), the bone of each joint that is nearest.

    Its end, the share along it of the place next to the point, and the distance from there, m.
    """
    local = points - skeleton.at_rest(skeleton.offsets)[joints]
    tips, shares = joints.copy(), np.zeros(len(joints))
    distances = np.linalg.norm(local, axis=-1)
    arms = np.concatenate([skeleton.offsets, skeleton.tip_offsets])
    above = (*skeleton.parents, *skeleton.tip_joints)
    for end, (arm, joint) in enumerate(zip(arms, above, strict=True)):
        square = float(arm @ arm)
        if joint < 0 or square == 0.0:
            continue
        of_joint = np.flatnonzero(joints == joint)
        share = np.clip(local[of_joint] @ arm / square, 0.0, 1.0)
        to_bone = np.linalg.norm(local[of_joint] - share[:, None] * arm, axis=-1)
        nearer = to_bone < distances[of_joint]
        tips[of_joint[nearer]], shares[of_joint[nearer]] = end, share[nearer]
        distances[of_joint[nearer]] = to_bone[nearer]
    return tips, shares, distances


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
    bone_numbers = np.arange(1, len(joints) + 1, dtype=np.int32)
    arms = np.concatenate([skeleton.offsets[1:], skeleton.tip_offsets])
    visible = _lengths(arms) > SHORTEST * size
    followed = {*skeleton.parents[1:], *joints[count - 1 :][visible[count - 1 :]].tolist()}
    stubs = np.array([joint for joint in range(count) if joint not in followed], np.int32)
    joints, bone_numbers = (
        np.append(joints[visible], stubs),
        np.append(bone_numbers[visible], stubs),
    )
    up = np.tile([0.0, 2 * STUB * size, 0.0], (len(stubs), 1))
    arms = np.concatenate([arms[visible], up])
    starts = rest[joints]
    starts[len(starts) - len(stubs) :] -= up / 2
    radii = np.clip(THICKNESS * _lengths(arms), THINNEST * size, THICKEST * size)
    radii[len(radii) - len(stubs) :] = STUB * size
    # Of boxes that coincide the first is drawn.
    rows = np.round(np.concatenate([starts, arms], axis=-1), 5)
    first_rows = np.sort(np.unique(rows, axis=0, return_index=True)[1])
    joints, bone_numbers, starts, arms, radii = (
        joints[first_rows],
        bone_numbers[first_rows],
        starts[first_rows],
        arms[first_rows],
        radii[first_rows],
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
        *distinct_places(
            np.repeat(np.stack([joints, bone_numbers], axis=-1), POINTS_PER_BOX, axis=0),
            np.tile(RING_POSITIONS.reshape(-1).astype(float), len(bone_numbers)),
        ),
        movers,
        np.full(movers.shape, FULL_WEIGHT, np.uint8),
        counts,
        corners,
        np.repeat(tints, POINTS_PER_BOX),
        triangles(counts, corners),
    )


def _points_and_normals(starts: Floats, arms: Floats, radii: Floats) -> tuple[Singles, Singles]:
    """Return points and normals (10 K, 3) of K boxes from near to far ends, m."""
    direction = arms / _lengths(arms)[:, None]
    helper = np.where(np.abs(direction[:, 2:]) > 0.9, [1.0, 0.0, 0.0], [0.0, 0.0, 1.0])
    first = quat.cross(helper, direction)
    first /= _lengths(first)[:, None]
    rows = (starts, arms, direction, first, quat.cross(direction, first))
    start, arm, forward, *across = (np.ascontiguousarray(a.T, np.float32) for a in rows)
    radial = RING_CORNERS[0] * across[0] + RING_CORNERS[1] * across[1]
    points = start + RING_POSITIONS * arm + RING_WIDTHS * np.float32(radii) * radial
    radial[0], radial[-1] = -forward, forward
    points, normals = (a.transpose(2, 0, 1).reshape(-1, 3) for a in (points, radial))
    return np.ascontiguousarray(points, np.float32), np.ascontiguousarray(normals, np.float32)


def _lengths(arms: Floats) -> Floats:
    x, y, z = arms[..., 0], arms[..., 1], arms[..., 2]
    return np.sqrt(x * x + y * y + z * z)
