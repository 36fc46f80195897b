"""Boxes that moving bodies never leave, for many motions at once.

Joints and tips are placed exactly, by forward kinematics; what is drawn of a body lies within
balls about them that are the same for all frames.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from service.encode import body
from service.encode.moves import Moves
from service.motion.conventions import Floats, Singles
from service.motion.skeleton import Skeleton

Places = npt.NDArray[np.intp]

# Of float32 the last bits add up along a chain of joints and a path that leads away; points and
# joints are rounded to it on their own, too, and readers turn them in it.
SLACK = 1e-5
FRAMES = 3200
"""Poses that are placed at a time: their numbers fit the processor's cache."""


@dataclass(frozen=True)
class Generation:
    """Points as many joints away from the root, and what they hang on.

    points: their places in the tree's order. turns: the places of those of them, the first, on
    which others hang, among the turning joints. holders: of each the place of the joint that it
    hangs on, and turners: the same among the turning joints; slices where they are neighbours.
    """

    points: slice
    turns: slice
    holders: Places | slice
    turners: Places | slice


@dataclass(frozen=True)
class Tree:
    """A skeleton's points: its joints, then its tips (E, 3), which are as far from theirs, m.

    order (P,): of the points by generation, those first on which others hang. turning (T,): the
    joints on which any point hangs, in that order.
    """

    tips: Floats
    order: Places
    turning: Places
    generations: tuple[Generation, ...]


def tree(skeleton: Skeleton) -> Tree:
    """Points of a skeleton by generation."""
    above = np.array([*skeleton.parents, *skeleton.tip_joints])
    depths = np.zeros(len(above), int)
    for point, parent in enumerate(above[1:], start=1):
        depths[point] = depths[parent] + 1
    bare = ~np.isin(np.arange(len(above)), above)
    order = np.lexsort((bare, depths))
    turning = order[~bare[order]]
    return Tree(skeleton.tip_offsets, order, turning, tuple(_grown(above, depths, order, turning)))


def boxes(tree: Tree, moves: Moves, balls: Floats) -> Floats:
    """Lowest and highest corner (M, 2, 3) of all that each motion does in its own frame, m.

    balls (M, P): radii about joints and tips, m. No motion's box hangs on the others.
    """
    found = [_boxes(tree, part) for part in moves.parts(FRAMES)]
    (low, high), radii = np.concatenate(found, axis=-1), balls.T[tree.order]
    return outwards((low - radii).min(axis=1).T, (high + radii).max(axis=1).T)


def anywhere(skeleton: Skeleton, offsets: Floats, path: Floats) -> Floats:
    """Lowest and highest corner (2, 3) of the skeleton's body in any pose, if its bones have the
    offsets (J, 3) and its root follows a path (F, 3), m."""
    own = np.linalg.norm(np.concatenate([skeleton.offsets, skeleton.tip_offsets]), axis=-1)
    arms = own.copy()
    arms[: len(offsets)] = np.maximum(own[: len(offsets)], np.linalg.norm(offsets, axis=-1))
    far = [0.0]
    for arm, parent in zip(arms[1:], (*skeleton.parents[1:], *skeleton.tip_joints), strict=True):
        far.append(far[parent] + arm)
    # A body that is nowhere wide is drawn as if it were a metre.
    reached = max(far) + body.THICKEST * (2.0 * max(far) or 1.0)
    return outwards(path.min(axis=0) - reached, path.max(axis=0) + reached)


def outwards(low: Floats, high: Floats) -> Floats:
    """Corners (..., 2, 3) moved apart by a share of a metre and of the largest coordinate."""
    slack = SLACK * (1.0 + np.maximum(np.abs(low), np.abs(high)))
    return np.stack([low - slack, high + slack], axis=-2)


def _grown(above: Places, depths: Places, order: Places, turning: Places) -> Iterator[Generation]:
    place, turner = np.argsort(order), {joint: at for at, joint in enumerate(turning.tolist())}
    for depth in range(1, depths.max() + 1):
        points = slice(*np.searchsorted(depths[order], [depth, depth + 1]))
        turns = slice(*np.searchsorted(depths[turning], [depth, depth + 1]))
        holders = above[order[points]]
        turners = np.array([turner[joint] for joint in holders.tolist()])
        yield Generation(points, turns, _neighbours(place[holders]), _neighbours(turners))


def _neighbours(places: Places) -> Places | slice:
    """A slice where it will do: of an array that is a view, and no copy."""
    first, count = int(places[0]), len(places)
    return slice(first, first + count) if np.all(np.diff(places) == 1) else places


def _boxes(tree: Tree, moves: Moves) -> Singles:
    """Lowest and highest place (2, 3, P, M) of each point."""
    places = _places(tree, moves)
    low = np.minimum.reduceat(places, moves.starts[:-1], axis=-1)
    return np.stack([low, np.maximum.reduceat(places, moves.starts[:-1], axis=-1)])


def _places(tree: Tree, moves: Moves) -> Singles:
    """Places (3, P, N) of points in the tree's order, m.

    Components come first, unlike elsewhere: it is ten times as fast. Some stand there twice, so
    that a vector product takes three calls of NumPy, which at this size cost as much as the
    arithmetic. And there is no operation but plain ones of two numbers, whose results do not hang
    on what else is in the arrays.
    """
    turns = _turns(tree, moves)
    arms = np.repeat(_arms(tree, moves.offsets), np.diff(moves.starts), axis=-1)
    places = np.empty((3, *arms.shape[1:]), np.float32)
    places[:, 0] = moves.path.T
    for each in tree.generations:
        held = _rows(turns, each.turners)
        here = places[:, each.points]
        _rotate(held, arms[:, each.points], here)
        here += _rows(places, each.holders)
        # In place: nothing reads a joint's local turn once its parent's is known.
        own = turns[:, each.turns]
        _turn(held[:, : own.shape[1]], own)
    return places


def _rows(components: Singles, chosen: Places | slice) -> Singles:
    return components[:, chosen] if isinstance(chosen, slice) else components.take(chosen, 1)


def _turns(tree: Tree, moves: Moves) -> Singles:
    """Rotations (6, T, N) of the joints that turn others, x y z x y w; a motion at a time, which
    the processor's cache holds."""
    made = np.empty((6, len(tree.turning), len(moves.rotations)), np.float32)
    for first, last in pairwise(moves.starts):
        turning = moves.rotations[first:last].take(tree.turning, 1).transpose(2, 1, 0)
        made[:3, :, first:last], made[5, :, first:last] = turning[:3], turning[3]
    made[3:5] = made[:2]
    return made


def _arms(tree: Tree, offsets: Singles) -> Singles:
    """How far (5, P, M) points in the tree's order are from the joints that they hang on, as
    x y z x y, m."""
    tips = np.broadcast_to(tree.tips.astype(np.float32), (len(offsets), *tree.tips.shape))
    arms = np.concatenate([offsets, tips], axis=1)[:, tree.order]
    return arms.transpose(2, 1, 0)[[0, 1, 2, 0, 1]]


def _turn(a: Singles, b: Singles) -> None:
    """Make of each quaternion b, x y z x y w, the product a b."""
    vector, part = _cross(a, b), np.empty_like(a[:3])
    vector += np.multiply(a[5], b[:3], out=part)
    vector += np.multiply(a[:3], b[5], out=part)
    np.multiply(a[:3], b[:3], out=part)
    b[5] *= a[5]
    for row in part:
        b[5] -= row
    b[:3], b[3:5] = vector, vector[:2]


def _rotate(q: Singles, v: Singles, out: Singles) -> None:
    """Vectors x y z x y turned by quaternions, as x y z."""
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
