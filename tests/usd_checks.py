"""Defects of USD characters that make some reader show a wrong motion or none.

USD's own validators run too, but detect few of these: a file that passes them may still show its
rest pose, or have no skeleton at all, in Blender or in a browser.
"""

import re
from functools import cache

import numpy as np
from pxr import Usd, UsdGeom, UsdSkel, UsdUtils, UsdValidation

METADATA = ("upAxis", "metersPerUnit", "timeCodesPerSecond")
"""Metadata of which readers have different fallbacks."""
COMPONENTS = ("translations", "rotations", "scales")
"""Components of an animation; without any of them some readers show the rest pose."""
LEGAL = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
TOLERANCE = 1e-3
"""Largest difference of a length or of a sum of weights from 1; half precision errs by 5e-4."""


def defects(path):
    """Return the defects of a file, a line each."""
    # Suppresses pxr's output, which repeats the validators' messages.
    quiet = UsdUtils.CoalescingDiagnosticDelegate()
    stage = Usd.Stage.Open(str(path))
    found = [f"no {key}" for key in METADATA if not stage.HasAuthoredMetadata(key)]
    if not stage.GetDefaultPrim() or stage.GetStartTimeCode() != 0:
        found.append("no default prim, or a start other than 0")
    prims = stage.Traverse(Usd.TraverseInstanceProxies())
    skeletons = [prim for prim in prims if prim.IsA(UsdSkel.Skeleton)]
    found += [f"{prim.GetPath()}: {line}" for prim in skeletons for line in _skeleton(stage, prim)]
    found += [f"{fault.GetName()}: {fault.GetMessage().strip()}" for fault in _validate(stage)]
    quiet.TakeUncoalescedDiagnostics()
    return found if skeletons else ["no skeleton", *found]


@cache
def _validators():
    return UsdValidation.ValidationRegistry().GetOrLoadAllValidators()


def _validate(stage):
    return UsdValidation.ValidationContext(_validators()).Validate(stage)


def _array(prim, name, time=None):
    value = prim.GetAttribute(name).Get(Usd.TimeCode.Default() if time is None else time)
    return np.array([] if value is None else value, dtype=float)


def _joints(prim):
    return [str(joint) for joint in prim.GetAttribute("joints").Get() or ()]


def _skeleton(stage, skeleton):
    joints, root = _joints(skeleton), UsdSkel.Root.Find(skeleton).GetPrim()
    leaves = [joint.rpartition("/")[2] for joint in joints]
    if not joints or not all(map(LEGAL.fullmatch, leaves)) or len(set(leaves)) < len(leaves):
        yield "joint names that are missing, illegal or not unique"
    if any("/" in j and j.rpartition("/")[0] not in joints[:at] for at, j in enumerate(joints)):
        yield "a joint before its parent"
    for name in ("restTransforms", "bindTransforms"):
        turns = _array(skeleton, name).reshape(-1, 4, 4)[:, :3, :3]
        products = turns @ np.swapaxes(turns, -1, -2)
        if len(turns) != len(joints) or not np.allclose(products, np.eye(3), atol=1e-4):
            yield f"{name} that are missing or not rigid"
    if not root:
        yield "no SkelRoot"
        return
    below = Usd.PrimRange(root, Usd.TraverseInstanceProxies())
    meshes = [prim for prim in below if len(_array(prim, "primvars:skel:jointIndices"))]
    if not meshes:
        yield "no skinned mesh: some readers find no bones"
    if not all(prim.HasAPI(UsdSkel.BindingAPI) for prim in (root, skeleton, *meshes)):
        yield "no SkelBindingAPI"
    for mesh in meshes:
        yield from _mesh(mesh, len(joints))
    animation = UsdSkel.BindingAPI(skeleton).GetInheritedAnimationSource()
    if not animation:
        yield "no animation"
        return
    yield from _animation(stage, animation, joints)
    yield from _extent(root, skeleton, animation)


def _mesh(mesh, joints):
    indices, weights = (_array(mesh, f"primvars:skel:joint{n}") for n in ("Indices", "Weights"))
    size = UsdGeom.Primvar(mesh.GetAttribute("primvars:skel:jointWeights")).GetElementSize()
    points = len(_array(mesh, "points"))
    if not len(indices) == len(weights) == size * points:
        yield f"{len(weights)} weights of {points} points"
    elif np.abs(weights.reshape(-1, size).sum(axis=1) - 1).max() > TOLERANCE:
        yield "weights of a point that do not sum to 1"
    if indices.min() < 0 or indices.max() >= joints:
        yield "a weight of no joint"


def _animation(stage, animation, joints):
    if _joints(animation) != joints:
        yield "other joints in the animation"
    frames = np.arange(stage.GetStartTimeCode(), stage.GetEndTimeCode() + 1).tolist()
    for name in COMPONENTS:
        codes = animation.GetAttribute(name).GetTimeSamples()
        values = [_array(animation, name, code) for code in codes] or [_array(animation, name)]
        if any(len(value) != len(joints) or not np.isfinite(value).all() for value in values):
            yield f"{name} that are missing, miscounted or not finite"
        if name != "scales" and codes != frames:
            yield f"frames without {name}, or some outside the range"
        if name == "rotations":
            rotations = np.array(values)
            if np.abs(np.linalg.norm(rotations, axis=-1) - 1).max() > TOLERANCE:
                yield "rotations that are no unit quaternions"
            if np.any(np.sum(rotations[1:] * rotations[:-1], axis=-1) < 0):
                yield "changes of sign between frames: some readers spin there"


def _extent(root, skeleton, animation):
    query = UsdSkel.Cache().GetSkelQuery(UsdSkel.Skeleton(skeleton))
    for code in animation.GetAttribute("rotations").GetTimeSamples():
        box, places = _array(root, "extent", code), UsdGeom.XformCache(Usd.TimeCode(code))
        to_root, _ = places.ComputeRelativeTransform(skeleton, root)
        matrices = np.array(query.ComputeJointSkelTransforms(code)).reshape(-1, 4, 4)
        joints = (matrices @ np.array(to_root))[:, 3, :3]
        if box.shape != (2, 3) or np.max([box[0] - joints, joints - box[1]]) > 1e-4 * np.ptp(box):
            yield f"a joint outside the extent at {code:g}"
            return
