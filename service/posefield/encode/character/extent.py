"""Extents: bounding boxes of skinned characters over whole motions, for many motions at once.

Positions of joints and tips are exact, by forward kinematics; the body lies within spheres about
them whose radii are the same for all frames.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from posefield.common.units import Floats, Singles
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

    points: their places in the tree's order. turns: places, among the turning joints, of those
    points that have children; they come first. holders: place of each point's parent. turners: the
    same among the turning joints. Slices stand for consecutive places.
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
    found = [_point_boxes(tree, part) for part in moves.parts(FRAMES_AT_ONCE)]
    (low, high), radii = np.concatenate(found, axis=-1), balls.T[tree.order]
    return enlarged_box((low - radii).min(axis=1).T, (high + radii).max(axis=1).T)


def pose_independent_box(skeleton: Skeleton, offsets: Floats, path: Floats) -> Floats:
    """Return a box (2, 3), m, that contains the body in any pose.

    offsets: of the bones (J, 3), m. path: root positions (F, 3), m.
    """
    own = np.linalg.norm(np.concatenate([skeleton.offsets, skeleton.tip_offsets]), axis=-1)
    arms = own.copy()
    arms[: len(offsets)] = np.maximum(own[: len(offsets)], np.linalg.norm(offsets, axis=-1))
    far = [0.0]
    for arm, parent in zip(arms[1:], (*skeleton.parents[1:], *skeleton.tip_joints), strict=True):
        far.append(far[parent] + arm)
    # The body of a skeleton of zero size is drawn as if its size were a metre.
    reached = max(far) + THICKEST_BODY * (2.0 * max(far) or 1.0)
    return enlarged_box(path.min(axis=0) - reached, path.max(axis=0) + reached)


def enlarged_box(low: Floats, high: Floats) -> Floats:
    """Return corners (..., 2, 3) enlarged to allow for rounding errors.

    Each axis grows at both ends by SLACK (1 + its largest absolute coordinate).
    """
    slack = RELATIVE_MARGIN * (1.0 + np.maximum(np.abs(low), np.abs(high)))
    return np.stack([low - slack, high + slack], axis=-2)


def _tree_levels(
    above: PointIndices, depths: PointIndices, order: PointIndices, turning: PointIndices
) -> Iterator[TreeLevel]:
    place, turner = np.argsort(order), {joint: at for at, joint in enumerate(turning.tolist())}
    for depth in range(1, depths.max() + 1):
        points = slice(*np.searchsorted(depths[order], [depth, depth + 1]))
        turns = slice(*np.searchsorted(depths[turning], [depth, depth + 1]))
        holders = above[order[points]]
        turners = np.array([turner[joint] for joint in holders.tolist()])
        yield TreeLevel(points, turns, _as_slice(place[holders]), _as_slice(turners))


def _as_slice(places: PointIndices) -> PointIndices | slice:
    """Return a slice for consecutive places, since it selects a view instead of a copy."""
    first, count = int(places[0]), len(places)
    return slice(first, first + count) if np.all(np.diff(places) == 1) else places


def _point_boxes(tree: PointTree, moves: AnimationSamples) -> Singles:
    """Return the lowest and highest position (2, 3, P, M) of each point."""
    places = _point_positions(tree, moves)
    low = np.minimum.reduceat(places, moves.starts[:-1], axis=-1)
    return np.stack([low, np.maximum.reduceat(places, moves.starts[:-1], axis=-1)])


def _point_positions(tree: PointTree, moves: AnimationSamples) -> Singles:
    """Return the positions (3, P, N) of points in the tree's order, m.

    Components come first, unlike elsewhere, which is ten times as fast. Some are stored twice, so
    that a vector product takes three calls of NumPy; at this size calls cost as much as the
    arithmetic. All operations are elementwise, so that results do not depend on the other motions
    in the arrays.
    """
    turns = _joint_rotations(tree, moves)
    arms = np.repeat(_parent_offsets(tree, moves.offsets), np.diff(moves.starts), axis=-1)
    places = np.empty((3, *arms.shape[1:]), np.float32)
    places[:, 0] = moves.path.T
    for each in tree.generations:
        held = _select_rows(turns, each.turning_parents)
        here = places[:, each.points]
        _rotate(held, arms[:, each.points], here)
        here += _select_rows(places, each.parents)
        # In place: a joint's local rotation is not read after its orientation is computed.
        own = turns[:, each.turns]
        if own.size:
            _multiply_quaternions(held[:, : own.shape[1]], own)
    return places


def _select_rows(components: Singles, chosen: PointIndices | slice) -> Singles:
    return components[:, chosen] if isinstance(chosen, slice) else components.take(chosen, 1)


def _joint_rotations(tree: PointTree, moves: AnimationSamples) -> Singles:
    """Return the rotations (6, T, N) of the turning joints, as x y z x y w.

    Copied by motion, so that a copy fits the processor's cache.
    """
    made = np.empty((6, len(tree.turning), len(moves.rotations)), np.float32)
    for first, last in pairwise(moves.starts):
        turning = moves.rotations[first:last].take(tree.turning, 1).transpose(2, 1, 0)
        made[:3, :, first:last], made[5, :, first:last] = turning[:3], turning[3]
    made[3:5] = made[:2]
    return made


def _parent_offsets(tree: PointTree, offsets: Singles) -> Singles:
    """Return the offsets (5, P, M) of points from their parents, as x y z x y, m."""
    tips = np.broadcast_to(tree.tips.astype(np.float32), (len(offsets), *tree.tips.shape))
    arms = np.concatenate([offsets, tips], axis=1)[:, tree.order]
    return arms.transpose(2, 1, 0)[[0, 1, 2, 0, 1]]


def _multiply_quaternions(a: Singles, b: Singles) -> None:
    """Replace each quaternion b, x y z x y w, by the product a b."""
    vector, part = _cross(a, b), np.empty_like(a[:3])
    vector += np.multiply(a[5], b[:3], out=part)
    vector += np.multiply(a[:3], b[5], out=part)
    np.multiply(a[:3], b[:3], out=part)
    b[5] *= a[5]
    for row in part:
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
    made = a[1:4] * b[2:5]
    made -= a[2:5] * b[1:4]
    return made
