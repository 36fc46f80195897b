"""Bounds of a skinned body in any pose: spheres about joints and tips.

A joint moves a point rigidly, with its own bones: so in any pose the point stays as far from a
place along such a bone as at rest. A point that several joints move is the mean, by its weights, of
the points to which each would move it; so it is as far from the mean of those places as the mean of
those distances, at most. The body is therefore within the convex hull of spheres about the ends of
bones, whose radius is the largest such mean of the points near to each.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from posefield.common.units import Floats, Indices, Singles
from posefield.encode.body.skinned_mesh import FULL_WEIGHT, SkinnedMesh
from posefield.motion.skeleton import Skeleton


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
        moved = joints.at_rest(offsets - joints.offsets)
        return np.concatenate([moved, moved.take(joints.tip_joints, axis=1)], axis=1)

    def radii(self, moved: Floats, along: Floats) -> Floats:
        """Return the radii (M, J + E), m, of bodies made for bones of other lengths.

        moved: displacements of joints and tips (M, J + E, 3); along: of the body's places (M, R,
        3), m. A point and the place on the bone next to it move by different displacements, which
        are linear in the share along the bone; so the largest difference is at one of its ends.
        """
        start, end = moved.take(self.joints, axis=1), moved.take(self.ends, axis=1)
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
        found = []
        for held in (self.joints, self.ends):
            order = np.argsort(held, kind="stable")
            found.append((order, *np.unique(held[order], return_index=True)))
        return found

    def _spheres(self, differences: Floats) -> Floats:
        """Return the radius (M, J + E) about each joint and tip.

        differences (M, K): by how much the points of each group may be further away than at rest,
        m. A point may belong to several groups, so the largest counts for all.
        """
        found = np.zeros((len(differences), len(self.skeleton) + len(self.skeleton.tip_joints)))
        if not len(self.joints):
            return found
        radii = self.rest + differences.max(axis=1, keepdims=True)
        for order, points, firsts in self._groups_of_points:
            most = np.maximum.reduceat(radii.take(order, axis=1), firsts, axis=1)
            found[:, points] = np.maximum(found[:, points], most)
        return found


def bounds(skeleton: Skeleton, body: SkinnedMesh | None) -> BodyBounds:
    """Return the bounds of a body; None for no body."""
    if body is None:
        none = np.empty(0, np.intp)
        share = np.empty(0)
        return BodyBounds(skeleton, none, none, none, share, share, share)
    points, influences = np.nonzero(body.weights)
    joints = body.joints[points, influences].astype(np.intp)
    ends, shares, far = _nearest_bones(skeleton, body.points[points].astype(float), joints)
    means = np.zeros(len(body.points))
    np.add.at(means, points, far * body.weights[points, influences] / FULL_WEIGHT)
    far = means[points]
    keys = np.stack([joints, ends, body.place[points]])
    order = np.lexsort(keys)
    keys, shares, far = keys[:, order], shares[order], far[order]
    new = np.concatenate([[True], np.any(np.diff(keys) != 0, axis=0)])
    firsts = np.flatnonzero(new)
    joints, ends, places = keys[:, firsts]
    return BodyBounds(
        skeleton,
        joints,
        ends,
        places,
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
    ends, shares = joints.copy(), np.zeros(len(joints))
    far = np.linalg.norm(local, axis=-1)
    arms = np.concatenate([skeleton.offsets, skeleton.tip_offsets])
    above = (*skeleton.parents, *skeleton.tip_joints)
    for end, (arm, joint) in enumerate(zip(arms, above, strict=True)):
        square = float(arm @ arm)
        if joint < 0 or square == 0.0:
            continue
        own = np.flatnonzero(joints == joint)
        share = np.clip(local[own] @ arm / square, 0.0, 1.0)
        off = np.linalg.norm(local[own] - share[:, None] * arm, axis=-1)
        nearer = off < far[own]
        ends[own[nearer]], shares[own[nearer]] = end, share[nearer]
        far[own[nearer]] = off[nearer]
    return ends, shares, far


def _lengths(arms: Floats) -> Floats:
    x, y, z = arms[..., 0], arms[..., 1], arms[..., 2]
    return np.sqrt(x * x + y * y + z * z)
