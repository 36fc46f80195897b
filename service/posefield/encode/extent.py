"""Motions in USD's form, and extents: bounding boxes of skinned characters over whole motions.

Quaternions are float32 with the real part last, and neighbours have one sign. Positions of joints
and tips are exact, by forward kinematics; the body lies within the spheres of `BodyBounds` about
them, whose radii are the same for all frames.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from posefield.common.units import Floats, Indices, Singles
from posefield.motion.clip import Clip, Motions
from posefield.motion.skeleton import Skeleton


@dataclass(frozen=True)
class AnimationSamples:
    """M motions of one skeleton, concatenated: motion m has the frames starts[m] to starts[m + 1].

    rotations (N, J, 4): of all frames, real part last. path (N, 3): root positions, m. offsets (M,
    J, 3): of the bones, m; the root's is not used. starts: (M + 1,). hips (N, 3): translations of
    joint 1 below a root bone, m; None where there is none. No number is -0.
    """

    rotations: Singles
    path: Singles
    offsets: Singles
    starts: Indices
    hips: Singles | None = None

    def __len__(self) -> int:
        return len(self.offsets)

    @cached_property
    def translations(self) -> Singles:
        """Return the local translations (N, J, 3), m."""
        local = np.repeat(self.offsets, np.diff(self.starts), axis=0)
        local[:, 0] = self.path
        if self.hips is not None:
            local[:, 1] = self.hips
        return local

    def parts(self, frames: int) -> Iterator["AnimationSamples"]:
        """Yield the motions in parts of at most `frames` frames, longer motions one by one."""
        first = 0
        while first < len(self):
            last = int(np.searchsorted(self.starts, self.starts[first] + frames, "right")) - 1
            last = max(last, first + 1)
            yield self._between(first, last)
            first = last

    def _between(self, first: int, last: int) -> "AnimationSamples":
        frames = slice(self.starts[first], self.starts[last])
        starts = self.starts[first : last + 1] - self.starts[first]
        offsets = self.offsets[first:last]
        hips = None if self.hips is None else self.hips[frames]
        return AnimationSamples(self.rotations[frames], self.path[frames], offsets, starts, hips)


def samples_of_clips(clips: Sequence[Clip], root_bone: bool = False) -> AnimationSamples:
    """Return the moves of clips of one skeleton, with the bone offsets of their first frames."""
    starts = _starts([len(clip) for clip in clips])
    samples = _empty(starts, len(clips[0].skeleton))
    for index, clip in enumerate(clips):
        frames = slice(starts[index], starts[index + 1])
        _write_real_part_last(clip.rotations, samples.rotations[frames])
        samples.path[frames] = clip.translations[:, 0]
        samples.offsets[index] = clip.translations[0]
    if root_bone:
        samples = replace(
            samples, hips=np.concatenate([c.translations[:, 1] for c in clips], dtype="f4")
        )
    return _normalize(samples)


def samples_of_motions(batch: Motions) -> AnimationSamples:
    """Return the moves of a crowd's motions."""
    count, frames, joints = batch.rotations.shape[:3]
    samples = _empty(_starts([frames] * count), joints)
    _write_real_part_last(batch.rotations.reshape(-1, joints, 4), samples.rotations)
    samples.path[:] = batch.root_position.reshape(-1, 3)
    samples.offsets[:] = batch.bone_offsets
    return _normalize(samples)


def _starts(frames: Sequence[int]) -> Indices:
    return np.concatenate([[0], np.cumsum(frames)])


def _empty(starts: Indices, joints: int) -> AnimationSamples:
    motions, frames = len(starts) - 1, int(starts[-1])
    rotations = np.empty((frames, joints, 4), np.float32)
    path, offsets = np.empty((frames, 3), np.float32), np.empty((motions, joints, 3), np.float32)
    return AnimationSamples(rotations, path, offsets, starts)


def _write_real_part_last(wxyz: Floats | Singles, xyzw: Singles) -> None:
    """Write quaternions with the real part last.

    All numbers move by one in a single copy, then the real parts are set.
    """
    source, target = np.ascontiguousarray(wxyz).reshape(-1), xyzw.reshape(-1)
    target[:-1] = source[1:]
    target[3::4] = source[::4]


def _normalize(samples: AnimationSamples) -> AnimationSamples:
    _unroll_quaternions(samples)
    for values in (samples.rotations, samples.path, samples.offsets, samples.hips):
        if values is not None:
            # USD's deduplication does not distinguish -0 from 0.
            values += np.float32(0.0)
    return samples


def _unroll_quaternions(samples: AnimationSamples) -> None:
    """Choose signs so that neighbours lie close: some readers interpolate by component."""
    products = samples.rotations[1:] * samples.rotations[:-1]
    dots = products[..., 0] + products[..., 1] + products[..., 2] + products[..., 3]
    dots[samples.starts[1:-1] - 1] = 1.0
    if not len(dots) or dots.min() >= 0:
        return
    signs = np.where(dots < 0, np.float32(-1.0), np.float32(1.0))
    for first, last in zip(samples.starts, samples.starts[1:], strict=False):
        turned = np.cumprod(signs[first : last - 1], axis=0, dtype=np.float32)
        samples.rotations[first + 1 : last] *= turned[..., None]


PointIndices = npt.NDArray[np.intp]

# Rounding to float32 accumulates along a chain of joints and far from the origin. Points and joints
# in a file are rounded separately, and readers compute with them in float32.
RELATIVE_MARGIN = 1e-5
THICKEST_BODY = 0.1
"""Largest distance of a body from its bones beside the size of its skeleton."""
FRAMES_AT_ONCE = 3200
"""Poses that are computed at a time: their arrays fit the processor's cache."""


@dataclass(frozen=True)
class PointLevel:
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
    generations: tuple[PointLevel, ...]


def tree(skeleton: Skeleton) -> PointTree:
    """Return the points of a skeleton by depth."""
    above = np.array([*skeleton.parents, *skeleton.tip_joints])
    depths = np.zeros(len(above), int)
    for point, parent in enumerate(above[1:], start=1):
        depths[point] = depths[parent] + 1
    is_leaf = ~np.isin(np.arange(len(above)), above)
    order = np.lexsort((is_leaf, depths))
    turning = order[~is_leaf[order]]
    return PointTree(
        skeleton.tip_offsets, order, turning, tuple(_point_levels(above, depths, order, turning))
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
    reaches = [0.0]
    for arm, parent in zip(arms[1:], (*skeleton.parents[1:], *skeleton.tip_joints), strict=True):
        reaches.append(reaches[parent] + arm)
    # The body of a skeleton of zero size is drawn as if its size were a metre.
    reach = max(reaches) + THICKEST_BODY * (2.0 * max(reaches) or 1.0)
    return enlarged_box(path.min(axis=0) - reach, path.max(axis=0) + reach)


def enlarged_box(low: Floats, high: Floats) -> Floats:
    """Return corners (..., 2, 3) enlarged to allow for rounding errors.

    Each axis grows at both ends by RELATIVE_MARGIN (1 + its largest absolute coordinate).
    """
    slack = RELATIVE_MARGIN * (1.0 + np.maximum(np.abs(low), np.abs(high)))
    return np.stack([low - slack, high + slack], axis=-2)


def _point_levels(
    above: PointIndices, depths: PointIndices, order: PointIndices, turning: PointIndices
) -> Iterator[PointLevel]:
    rank, turner = np.argsort(order), {joint: at for at, joint in enumerate(turning.tolist())}
    for depth in range(1, depths.max() + 1):
        points = slice(*np.searchsorted(depths[order], [depth, depth + 1]))
        turns = slice(*np.searchsorted(depths[turning], [depth, depth + 1]))
        holders = above[order[points]]
        turners = np.array([turner[joint] for joint in holders.tolist()])
        yield PointLevel(points, turns, _as_slice(rank[holders]), _as_slice(turners))


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
        level_positions = positions[:, level.points]
        _rotate(parent_turns, arms[:, level.points], level_positions)
        level_positions += _select_rows(positions, level.parents)
        # In place: a joint's local rotation is not read after its orientation is computed.
        level_turns = turns[:, level.turns]
        if level_turns.size:
            _multiply_quaternions(parent_turns[:, : level_turns.shape[1]], level_turns)
    return positions


def _select_rows(components: Singles, rows: PointIndices | slice) -> Singles:
    return components[:, rows] if isinstance(rows, slice) else components.take(rows, 1)


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
