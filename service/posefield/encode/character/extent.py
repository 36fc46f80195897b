"""Extents: bounding boxes of skinned characters over whole motions, for many motions at once.

Positions of joints and tips are exact, by forward kinematics; the body lies within spheres about
them whose radii are the same for all frames.

A joint moves a point rigidly, with its own bones: so in any pose the point stays as far from a
place along such a bone as at rest. A point that several joints move is the mean, by its weights, of
the points to which each would move it; so it is as far from the mean of those places as the mean of
those distances, at most. The body is therefore within the convex hull of spheres about the ends of
bones, whose radius is the largest such mean of the points near to each.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from posefield.common.units import Floats, Indices, Singles
from posefield.encode.body.skinned_mesh import FULL_WEIGHT, SkinnedMesh
from posefield.encode.character.animation_samples import AnimationSamples
from posefield.motion.skeleton import Skeleton

PointIndices = npt.NDArray[np.intp]

# Rounding to float32 accumulates along a chain of joints and far from the origin. Points and joints
# in a file are rounded separately, and readers compute with them in float32.
RELATIVE_MARGIN = 1e-5
THICKEST_BODY = 0.1
"""Largest distance of a body from its bones beside the size of its skeleton."""
FRAMES_AT_ONCE = 3200
"""Poses that are computed at a time: their arrays fit the processor's cache."""


@dataclass(frozen=True)
class TreeLevel:
    """Points of one depth in the tree, and their parents.

    points: their indices in the tree's order. turns: indices, among the turning joints, of those
    points that have children; they come first. parents: index of each point's parent.
    turning_parents: the same among the turning joints. Slices stand for consecutive indices.
    """

    points: slice
    turns: slice
    parents: PointIndices | slice
    turning_parents: PointIndices | slice


@dataclass(frozen=True)
class PointTree:
    """Points of a skeleton: its joints, then its tips.

    tips (E, 3): offsets from their joints, m. order (P,): points by depth, those with children
    first. turning (T,): points with children, in that order. generations: from the root's children
    on.
    """

    tips: Floats
    order: PointIndices
    turning: PointIndices
    generations: tuple[TreeLevel, ...]


def tree(skeleton: Skeleton) -> PointTree:
    """Return the points of a skeleton by depth."""
    above = np.array([*skeleton.parents, *skeleton.tip_joints])
    depths = np.zeros(len(above), int)
    for point, parent in enumerate(above[1:], start=1):
        depths[point] = depths[parent] + 1
    bare = ~np.isin(np.arange(len(above)), above)
    order = np.lexsort((bare, depths))
    turning = order[~bare[order]]
    return PointTree(
        skeleton.tip_offsets, order, turning, tuple(_tree_levels(above, depths, order, turning))
    )


def bounding_boxes(tree: PointTree, moves: AnimationSamples, balls: Floats) -> Floats:
    """Return the lowest and highest corner (M, 2, 3) of each motion in its own frame, m.

    balls (M, P): radii about joints and tips, m. The boxes of the motions are independent.
    """
    boxes = []
    for frames in moves.parts(FRAMES_AT_ONCE):
        points = _point_positions(tree, frames)
        extremes = (np.minimum, np.maximum)
        boxes.append(np.stack([e.reduceat(points, frames.starts[:-1], axis=-1) for e in extremes]))
    (low, high), radii = np.concatenate(boxes, axis=-1), balls.T[tree.order]
    return enlarged_box((low - radii).min(axis=1).T, (high + radii).max(axis=1).T)


def pose_independent_box(skeleton: Skeleton, offsets: Floats, path: Floats) -> Floats:
    """Return a box (2, 3), m, that contains the body in any pose.

    offsets: of the bones (J, 3), m. path: root positions (F, 3), m.
    """
    lengths = np.linalg.norm(np.concatenate([skeleton.offsets, skeleton.tip_offsets]), axis=-1)
    arms = lengths.copy()
    arms[: len(offsets)] = np.maximum(lengths[: len(offsets)], np.linalg.norm(offsets, axis=-1))
    far = [0.0]
    for arm, parent in zip(arms[1:], (*skeleton.parents[1:], *skeleton.tip_joints), strict=True):
        far.append(far[parent] + arm)
    # The body of a skeleton of zero size is drawn as if its size were a metre.
    reached = max(far) + THICKEST_BODY * (2.0 * max(far) or 1.0)
    return enlarged_box(path.min(axis=0) - reached, path.max(axis=0) + reached)


def enlarged_box(low: Floats, high: Floats) -> Floats:
    """Return corners (..., 2, 3) enlarged to allow for rounding errors.

    Each axis grows at both ends by RELATIVE_MARGIN (1 + its largest absolute coordinate).
    """
    slack = RELATIVE_MARGIN * (1.0 + np.maximum(np.abs(low), np.abs(high)))
    return np.stack([low - slack, high + slack], axis=-2)


def _tree_levels(
    above: PointIndices, depths: PointIndices, order: PointIndices, turning: PointIndices
) -> Iterator[TreeLevel]:
    rank, turner = np.argsort(order), {joint: at for at, joint in enumerate(turning.tolist())}
    for depth in range(1, depths.max() + 1):
        points = slice(*np.searchsorted(depths[order], [depth, depth + 1]))
        turns = slice(*np.searchsorted(depths[turning], [depth, depth + 1]))
        holders = above[order[points]]
        turners = np.array([turner[joint] for joint in holders.tolist()])
        yield TreeLevel(points, turns, _as_slice(rank[holders]), _as_slice(turners))


def _as_slice(indices: PointIndices) -> PointIndices | slice:
    """Return a slice for consecutive places, since it selects a view instead of a copy."""
    first, count = int(indices[0]), len(indices)
    return slice(first, first + count) if np.all(np.diff(indices) == 1) else indices


def _point_positions(tree: PointTree, moves: AnimationSamples) -> Singles:
    """Return the positions (3, P, N) of points in the tree's order, m.

    Components come first, unlike elsewhere, which is ten times as fast. Some are stored twice, so
    that a vector product takes three calls of NumPy; at this size calls cost as much as the
    arithmetic. All operations are elementwise, so that results do not depend on the other motions
    in the arrays.
    """
    turns = _joint_rotations(tree, moves)
    # Offsets of points from their parents, as x y z x y, m.
    tips = np.broadcast_to(tree.tips.astype(np.float32), (len(moves), *tree.tips.shape))
    arms = np.concatenate([moves.offsets, tips], axis=1)[:, tree.order].transpose(2, 1, 0)
    arms = np.repeat(arms[[0, 1, 2, 0, 1]], np.diff(moves.starts), axis=-1)
    if moves.hips is not None:
        arms[:, np.flatnonzero(tree.order == 1)[0]] = moves.hips.T[[0, 1, 2, 0, 1]]
    positions = np.empty((3, *arms.shape[1:]), np.float32)
    positions[:, 0] = moves.path.T
    for level in tree.generations:
        parent_turns = _select_rows(turns, level.turning_parents)
        here = positions[:, level.points]
        _rotate(parent_turns, arms[:, level.points], here)
        here += _select_rows(positions, level.parents)
        # In place: a joint's local rotation is not read after its orientation is computed.
        level_turns = turns[:, level.turns]
        if level_turns.size:
            _multiply_quaternions(parent_turns[:, : level_turns.shape[1]], level_turns)
    return positions


def _select_rows(components: Singles, chosen: PointIndices | slice) -> Singles:
    return components[:, chosen] if isinstance(chosen, slice) else components.take(chosen, 1)


def _joint_rotations(tree: PointTree, moves: AnimationSamples) -> Singles:
    """Return the rotations (6, T, N) of the turning joints, as x y z x y w.

    Copied by motion, so that a copy fits the processor's cache.
    """
    rotations = np.empty((6, len(tree.turning), len(moves.rotations)), np.float32)
    for first, last in pairwise(moves.starts):
        turning = moves.rotations[first:last].take(tree.turning, 1).transpose(2, 1, 0)
        rotations[:3, :, first:last], rotations[5, :, first:last] = turning[:3], turning[3]
    rotations[3:5] = rotations[:2]
    return rotations


def _multiply_quaternions(a: Singles, b: Singles) -> None:
    """Replace each quaternion b, x y z x y w, by the product a b."""
    vector, products = _cross(a, b), np.empty_like(a[:3])
    vector += np.multiply(a[5], b[:3], out=products)
    vector += np.multiply(a[:3], b[5], out=products)
    np.multiply(a[:3], b[:3], out=products)
    b[5] *= a[5]
    for row in products:
        b[5] -= row
    b[:3], b[3:5] = vector, vector[:2]


def _rotate(q: Singles, v: Singles, out: Singles) -> None:
    """Write vectors x y z x y rotated by quaternions to `out`, as x y z."""
    twice = np.empty_like(v)
    once = _cross(q, v)
    np.add(once, once, out=twice[:3])
    twice[3:] = twice[:2]
    np.add(v[:3], _cross(q, twice), out=out)
    out += np.multiply(q[5], twice[:3], out=once)


def _cross(a: Singles, b: Singles) -> Singles:
    product = a[1:4] * b[2:5]
    product -= a[2:5] * b[1:4]
    return product


@dataclass(frozen=True)
class BodyBounds:
    """Points of a body in K groups, of which each is moved by one joint and near to one bone.

    joints, ends (K,): the joint, and where the bone that is near leads; the joint itself where none
    is nearer. places (K,): the place among those of the body that the points of a group follow.
    lowest, highest (K,): shares of the way along the bone between which the points lie. rest (K,):
    largest mean distance of the points from their bones at rest, m.
    """

    skeleton: Skeleton
    joints: Indices
    ends: Indices
    places: Indices
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

        moved: displacements of joints and tips (M, J + E, 3); along: of the body's places (M, R,
        3), m. A point and the place on the bone next to it move by different displacements, which
        are linear in the share along the bone; so the largest difference is at one of its ends.
        """
        start, end = displaced.take(self.joints, axis=1), displaced.take(self.ends, axis=1)
        end -= start
        start -= along.take(self.places, axis=1)
        low, high = (start + share[:, None] * end for share in (self.lowest, self.highest))
        return self._spheres(np.maximum(_lengths(low), _lengths(high)))

    def radii_of_others(self, offsets: Floats | Singles) -> Floats:
        """Return the radii (M, J + E), m, where bone offsets (M, J, 3) move a body made at rest."""
        tips = np.zeros((len(offsets), len(self.skeleton.tip_joints), 3))
        longer = np.concatenate([offsets - self.skeleton.offsets, tips], axis=1)
        arms = longer.take(self.ends, axis=1)
        arms[:, self.ends == self.joints] = 0.0
        return self._spheres(self.highest * _lengths(arms))

    @cached_property
    def _groups_of_points(self) -> list[tuple[Indices, Indices, Indices]]:
        """Return, for each end of the bones, the groups in the order of its points (K,).

        With the points (P,), and the place in that order of each one's first group (P,).
        """
        groups = []
        for indices in (self.joints, self.ends):
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


def bounds(skeleton: Skeleton, body: SkinnedMesh | None) -> BodyBounds:
    """Return the bounds of a body; None for no body."""
    if body is None:
        none = np.empty(0, np.intp)
        share = np.empty(0)
        return BodyBounds(skeleton, none, none, none, share, share, share)
    points, influences = np.nonzero(body.weights)
    joints = body.joints[points, influences].astype(np.intp)
    tips, shares, far = _nearest_bones(skeleton, body.points[points].astype(float), joints)
    means = np.zeros(len(body.points))
    np.add.at(means, points, far * body.weights[points, influences] / FULL_WEIGHT)
    far = means[points]
    keys = np.stack([joints, tips, body.place[points]])
    order = np.lexsort(keys)
    keys, shares, far = keys[:, order], shares[order], far[order]
    new = np.concatenate([[True], np.any(np.diff(keys) != 0, axis=0)])
    firsts = np.flatnonzero(new)
    joints, tips, groups = keys[:, firsts]
    return BodyBounds(
        skeleton,
        joints,
        tips,
        groups,
        np.minimum.reduceat(shares, firsts),
        np.maximum.reduceat(shares, firsts),
        np.maximum.reduceat(far, firsts),
    )


def _nearest_bones(
    skeleton: Skeleton, points: Floats, joints: Indices
) -> tuple[Indices, Floats, Floats]:
    """Return, of points (K, 3) moved by joints (K,), the bone of each joint that is nearest.

    Its end, the share along it of the place next to the point, and the distance from there, m.
    """
    local = points - skeleton.at_rest(skeleton.offsets)[joints]
    tips, shares = joints.copy(), np.zeros(len(joints))
    far = np.linalg.norm(local, axis=-1)
    arms = np.concatenate([skeleton.offsets, skeleton.tip_offsets])
    above = (*skeleton.parents, *skeleton.tip_joints)
    for end, (arm, joint) in enumerate(zip(arms, above, strict=True)):
        square = float(arm @ arm)
        if joint < 0 or square == 0.0:
            continue
        of_joint = np.flatnonzero(joints == joint)
        share = np.clip(local[of_joint] @ arm / square, 0.0, 1.0)
        off = np.linalg.norm(local[of_joint] - share[:, None] * arm, axis=-1)
        nearer = off < far[of_joint]
        tips[of_joint[nearer]], shares[of_joint[nearer]] = end, share[nearer]
        far[of_joint[nearer]] = off[nearer]
    return tips, shares, far


def _lengths(arms: Floats) -> Floats:
    x, y, z = arms[..., 0], arms[..., 1], arms[..., 2]
    return np.sqrt(x * x + y * y + z * z)
