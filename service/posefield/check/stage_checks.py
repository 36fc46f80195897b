"""Checks of a stage's metadata and of the bindings between its prims."""

from collections.abc import Iterator
from typing import Any

from pxr import Usd, UsdSkel

from posefield.check import skeleton_bindings as rigs
from posefield.check.finding import Finding, error, warning
from posefield.check.skeleton_bindings import SkeletonBinding

FALLBACKS = {
    "upAxis": "readers differ in their fallback",
    "metersPerUnit": "the fallback of 0.01 makes a person of metres 2 cm tall",
    "timeCodesPerSecond": "the fallback of 24 changes the speed",
}


def metadata(stage: Any) -> Iterator[Finding]:
    """Yield findings on the metadata of the stage."""
    root = stage.GetPseudoRoot()
    for key, reason in FALLBACKS.items():
        if not stage.HasAuthoredMetadata(key):
            yield error(f"missing-{key}", root, f"no {key}; expected one, since {reason}")
    if not stage.GetDefaultPrim():
        found = stage.GetRootLayer().defaultPrim or "none"
        yield error("missing-defaultPrim", root, f"default prim {found}, expected a prim's name")
    if stage.GetStartTimeCode() != 0:
        message = (
            f"startTimeCode {stage.GetStartTimeCode():g}, expected 0: some readers begin there"
        )
        yield warning("start-not-zero", root, message)


def bindings(rig: SkeletonBinding) -> Iterator[Finding]:
    """Yield findings on the bindings of a skeleton to its root, animation and meshes."""
    if rig.root is None:
        message = "no SkelRoot above this skeleton, expected one instead of an Xform"
        yield error("no-skel-root", rig.skeleton, message)
    bound = [prim for prim in (rig.root, rig.skeleton, *skinned_meshes(rig)) if prim]
    for prim in bound:
        if not prim.HasAPI(UsdSkel.BindingAPI):
            message = f"a {prim.GetTypeName()} without SkelBindingAPI; expected it applied"
            yield error("missing-binding-api", prim, message)
    if rig.animation is None:
        message = "no SkelAnimation bound, expected one at skel:animationSource"
        yield error("no-animation", rig.skeleton, message)
    if not skinned_meshes(rig):
        message = "no mesh is skinned to this skeleton, expected one: some readers find no bones"
        yield error("no-skinned-mesh", rig.skeleton, message)


def skinned_meshes(rig: SkeletonBinding) -> list[Any]:
    """Return the prims below the skeleton's root that are skinned to it."""
    top = rig.root or rig.skeleton.GetParent()
    below = Usd.PrimRange(top, Usd.TraverseInstanceProxies())
    return [prim for prim in below if _skinned(prim, rig.skeleton)]


def _skinned(prim: Any, skeleton: Any) -> bool:
    if not rigs.is_authored(prim, "primvars:skel:jointIndices"):
        return False
    bound = UsdSkel.BindingAPI(prim).GetInheritedSkeleton()
    return bool(bound and bound.GetPrim() == skeleton)
