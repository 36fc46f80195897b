"""Checks of a skeleton's skinned meshes and of its extent."""

from collections.abc import Iterator
from typing import Any

import numpy as np
from pxr import Usd, UsdGeom, UsdSkel

from posefield.check import animation_checks
from posefield.check import skeleton_bindings as rigs
from posefield.check.finding import Finding, error
from posefield.check.skeleton_bindings import SkeletonBinding
from posefield.common.units import Floats

INDICES, WEIGHTS = "primvars:skel:jointIndices", "primvars:skel:jointWeights"
SUM_TOLERANCE = 1e-3
"""Largest deviation of the sum of a point's weights from 1; half precision errs by 5e-4."""
EXTENT_TOLERANCE = 1e-4
"""Largest distance of a joint outside the extent, as a share of the extent's diagonal."""


def influences(rig: SkeletonBinding, mesh: Any) -> Iterator[Finding]:
    """Yield findings on indices of missing joints, and on weights that are miscounted.

    Also on weights of a point that do not sum to one.
    """
    indices, weights = rigs.attribute_array(mesh, INDICES), rigs.attribute_array(mesh, WEIGHTS)
    count = len(rigs.attribute_tokens(mesh, "skel:joints") or rig.joints)
    outside = indices[(indices < 0) | (indices >= count)]
    if len(outside):
        message = f"joint index {outside[0]:.0f}, expected 0 to {count - 1}"
        yield error("joint-index-range", mesh, message)
    if len(weights) != len(indices):
        message = f"{len(weights)} joint weights, expected {len(indices)}, one an index"
        yield error("joint-weights-count", mesh, message)
        return
    yield from _weights(mesh, weights)


def extents(rig: SkeletonBinding) -> Iterator[Finding]:
    """Yield findings on a missing extent, and on one that does not contain all joints."""
    if rig.root is None:
        return
    if not rigs.is_authored(rig.root, "extent"):
        message = "no extent on the SkelRoot, expected the box of the whole motion"
        yield error("missing-extent", rig.root, message)
        return
    query = UsdSkel.Cache().GetSkelQuery(UsdSkel.Skeleton(rig.skeleton))
    if query and rig.animation:
        yield from _contained(rig, query)


def _weights(mesh: Any, weights: Floats) -> Iterator[Finding]:
    primvar = UsdGeom.Primvar(mesh.GetAttribute(WEIGHTS))
    size = max(primvar.GetElementSize(), 1)
    points = len(rigs.attribute_array(mesh, "points"))
    constant = primvar.GetInterpolation() == UsdGeom.Tokens.constant
    expected = size * (1 if constant else points)
    if len(weights) != expected:
        message = f"{len(weights)} joint weights, expected {expected}: elementSize {size} a point"
        yield error("joint-weights-count", mesh, message)
        return
    sums = weights.reshape(-1, size).sum(axis=-1)
    if len(sums) and not np.abs(sums - 1).max() <= SUM_TOLERANCE:
        worst = sums[np.argmax(np.abs(sums - 1))]
        message = f"joint weights of a point sum to {worst:.4g}, expected 1"
        yield error("joint-weights-sum", mesh, message)


def _contained(rig: SkeletonBinding, query: Any) -> Iterator[Finding]:
    for time, _ in animation_checks.samples(rig.animation, "rotations"):
        box = rigs.attribute_array(rig.root, "extent", time)
        joints = _positions(rig, query, time)
        if box.shape != (2, 3) or not len(joints):
            return
        out = float(np.max([box[0] - joints, joints - box[1]]))
        if out > EXTENT_TOLERANCE * float(np.linalg.norm(box[1] - box[0])):
            message = f"a joint is {out:.3g} outside the extent at time {time:g}, expected none"
            yield error("extent-too-small", rig.root, message)
            return


def _positions(rig: SkeletonBinding, query: Any, time: float) -> Floats:
    """Return the joint positions (J, 3) in the space of the root, which is that of its extent."""
    places = UsdGeom.XformCache(Usd.TimeCode(time))
    to_root, _ = places.ComputeRelativeTransform(rig.skeleton, rig.root)
    matrices = np.array(query.ComputeJointSkelTransforms(time)).reshape(-1, 4, 4)
    moved: Floats = (matrices @ np.array(to_root))[:, 3, :3]
    return moved
