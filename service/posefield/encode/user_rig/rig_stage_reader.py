"""Reading of the place of a skeleton in a user's USD file."""

from pathlib import Path
from typing import Any

import numpy as np
from pxr import Tf, Usd, UsdGeom, UsdSkel

from posefield.common.errors import UsdError
from posefield.common.units import Floats
from posefield.encode.user_rig.rig_stage import RigStage

ANIMATION = "Anim"
"""Name of the animation below the root prim, followed by a number where the file has it."""


def read_stage(path: Path, skeleton: str, joints: tuple[str, ...]) -> RigStage:
    """Return the place of a skeleton in a file.

    skeleton: path of the prim. joints: its tokens in the order of the rig. Raises UsdError for a
    skeleton to which no layer can bind an animation.
    """
    try:
        stage = Usd.Stage.Open(str(path))
    except Tf.ErrorException as fault:
        raise UsdError(path, f"does not open as USD: {fault.args[0].commentary}") from fault
    prim = stage.GetPrimAtPath(skeleton)
    if prim.IsInstanceProxy() or prim.IsInstance():
        raise UsdError(
            path,
            f"the skeleton {skeleton} lies in an instance, expected none: no other layer can bind "
            "an animation to it",
        )
    skel_root = UsdSkel.Root.Find(prim)
    if not skel_root:
        raise UsdError(path, f"the skeleton {skeleton} lies in no SkelRoot, expected one")
    root = stage.GetPrimAtPath("/" + skeleton.split("/")[1])
    cache = UsdGeom.XformCache()
    to_world = cache.GetLocalToWorldTransform(prim)
    to_root = to_world * cache.GetLocalToWorldTransform(skel_root.GetPrim()).GetInverse()
    return RigStage(
        skeleton,
        str(skel_root.GetPath()),
        f"{root.GetPath()}/{_free_name(root)}",
        joints,
        np.array(to_root, float),
        _radii(UsdSkel.Skeleton(prim), skel_root, joints),
        tuple(_lost_targets(root)),
    )


def _free_name(root: Any) -> str:
    """Return a name that no child of the root prim has."""
    taken, found, count = set(root.GetAllChildrenNames()), ANIMATION, 1
    while found in taken:
        count += 1
        found = f"{ANIMATION}_{count}"
    return found


def _radii(skeleton: Any, skel_root: Any, joints: tuple[str, ...]) -> Floats:
    """Return the largest distance (J,) of a point from a joint that moves it, at bind."""
    cache = UsdSkel.Cache()
    cache.Populate(skel_root, Usd.PrimDefaultPredicate)
    query = cache.GetSkelQuery(skeleton)
    order = [str(token) for token in query.GetJointOrder()]
    matrices = np.array(query.GetJointWorldBindTransforms(), float)
    if len(matrices) != len(order):
        path = skeleton.GetPath()
        raise ValueError(f"{path} has {len(matrices)} bindTransforms, expected {len(order)}")
    binds = matrices[:, 3, :3]
    found = dict.fromkeys(order, 0.0)
    for binding in cache.ComputeSkelBindings(skel_root, Usd.PrimDefaultPredicate):
        if binding.GetSkeleton().GetPath() == skeleton.GetPath():
            for skinned in binding.GetSkinningTargets():
                _widen(found, order, binds, skinned)
    return np.array([found[joint] for joint in joints])


def _widen(found: dict[str, float], order: list[str], binds: Floats, skinned: Any) -> None:
    """Widen the radii of the joints that move a skinned mesh."""
    points = UsdGeom.PointBased(skinned.GetPrim()).GetPointsAttr().Get()
    if not points:
        return
    matrix = np.array(skinned.GetGeomBindTransform(), float)
    placed = np.array(points, float) @ matrix[:3, :3] + matrix[3, :3]
    indices, weights = (
        np.array(part).reshape(len(placed), -1)
        for part in skinned.ComputeVaryingJointInfluences(len(placed))
    )
    own = [str(token) for token in skinned.GetJointOrder() or order]
    for column in range(indices.shape[1]):
        moved = weights[:, column] > 0.0
        for index in np.unique(indices[moved, column]).tolist():
            these = placed[moved & (indices[:, column] == index)]
            apart = np.linalg.norm(these - binds[order.index(own[index])], axis=-1)
            found[own[index]] = max(found[own[index]], float(apart.max()))


def _lost_targets(root: Any) -> list[str]:
    """Return a note if prims refer to others beside the root prim, which a reference leaves out."""
    below = root.GetPath()
    relations = (own for prim in Usd.PrimRange(root) for own in prim.GetAuthoredRelationships())
    targets = (target for relation in relations for target in relation.GetTargets())
    lost = sorted({str(target) for target in targets if not target.HasPrefix(below)})
    if not lost:
        return []
    return [
        f"prims below {below} refer to {len(lost)} prims beside it ({', '.join(lost[:3])}), which "
        f"a reference to {below} leaves out: move them below it"
    ]
