"""Small USD files for tests: a skeleton of two joints below transforms, and animations of it."""

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom, UsdSkel, Vt

JOINTS = ["upper", "upper/lower"]


def matrix(turn=(1, 0, 0, 0), place=(0, 0, 0), size=1.0):
    """A matrix for row vectors of a rotation w x y z, a translation and a scale."""
    turned = Gf.Matrix4d().SetRotate(Gf.Quatd(*map(float, turn)))
    scaled = Gf.Matrix4d().SetScale(float(size))
    return scaled * turned * Gf.Matrix4d().SetTranslate(Gf.Vec3d(*map(float, place)))


REST = [matrix(), matrix(place=(0, 1, 0))]


def stage(path, unit=1.0, up="Y", codes=30.0):
    """A stage with a SkelRoot and a Skeleton of an arm of two joints, 1 m long."""
    made = Usd.Stage.CreateNew(str(path))
    if unit is not None:
        UsdGeom.SetStageMetersPerUnit(made, unit)
    if up is not None:
        UsdGeom.SetStageUpAxis(made, up)
    if codes is not None:
        made.SetTimeCodesPerSecond(codes)
    UsdSkel.Root.Define(made, "/Root")
    skeleton(made, "/Root/Skel")
    return made


def skeleton(made, path, joints=JOINTS, rest=REST, bind=None):
    """Define a skeleton; bind: its bind transforms, else those of the arm."""
    own = UsdSkel.Skeleton.Define(made, path)
    own.CreateJointsAttr(joints)
    own.CreateRestTransformsAttr(Vt.Matrix4dArray(rest))
    own.CreateBindTransformsAttr(Vt.Matrix4dArray(bind or rest))
    return own


def animation(
    made, path, codes, turns, bind_to="/Root/Skel", joints=JOINTS, places=None, sizes=None
):
    """Define an animation; turns (F, J, 4) w x y z; places (F, J, 3), one for all by default."""
    own = UsdSkel.Animation.Define(made, path)
    own.CreateJointsAttr(joints)
    attributes = own.CreateRotationsAttr(), own.CreateTranslationsAttr(), own.CreateScalesAttr()
    still = [(0, 0, 0), (0, 1, 0)][-len(joints) :]
    if places is None:
        attributes[1].Set(Vt.Vec3fArray([Gf.Vec3f(*place) for place in still]))
    if sizes is None:
        attributes[2].Set(Vt.Vec3hArray(len(joints), Gf.Vec3h(1, 1, 1)))
    for frame, code in enumerate(np.asarray(codes, float).tolist()):
        quats = [Gf.Quatf(*map(float, turn)) for turn in turns[frame]]
        attributes[0].Set(Vt.QuatfArray(quats), code)
        if places is not None:
            moved = [Gf.Vec3f(*map(float, place)) for place in places[frame]]
            attributes[1].Set(Vt.Vec3fArray(moved), code)
        if sizes is not None:
            attributes[2].Set(Vt.Vec3hArray([Gf.Vec3h(*map(float, s)) for s in sizes[frame]]), code)
    if bind_to:
        prim = made.GetPrimAtPath(bind_to)
        UsdSkel.BindingAPI.Apply(prim).CreateAnimationSourceRel().SetTargets([Sdf.Path(path)])
    return own


def transform(made, path, value, code=None):
    """Give a prim a transform."""
    prim = UsdGeom.Xformable(made.GetPrimAtPath(path))
    ops = prim.GetOrderedXformOps()
    op = ops[0] if ops else prim.AddTransformOp()
    op.Set(value, Usd.TimeCode.Default() if code is None else code)
