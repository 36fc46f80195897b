"""Files of characters for tests: skeletons with other names, lengths, axes and units."""

import json
import struct
from dataclasses import replace

import numpy as np
from pxr import Gf, Usd, UsdGeom, UsdSkel, Vt

from posefield.encode.character import Convention
from posefield.encode.formats import CLIP_ENCODERS
from posefield.motion import joint_roles, quat
from posefield.motion.clip import Clip
from posefield.question.results import SampledClip, Trust

CENTIMETRES_Z = Convention(0.01, "z")
TURN = quat.normalize(np.array([0.6, -0.3, 0.5, 0.4]))
"""Rotation by which the axes of all joints differ from those of the world."""


def still(card, scale, names="mixamo"):
    """Return a clip of two frames at rest of a body like a model's, of other lengths and names."""
    joints = joint_roles.rename_joints(card.skeleton, card.roles, names)
    joints = replace(joints, offsets=joints.offsets * scale, tip_offsets=joints.tip_offsets * scale)
    rotations = np.tile(quat.IDENTITY, (2, len(joints), 1))
    return Clip(joints, rotations, np.tile(joints.offsets, (2, 1, 1)), 30.0)


def _written(form, card, scale, convention=None):
    trust = Trust("rig@0000000000000000", {}, None, 0, 1.0, 0.0, True, ())
    return CLIP_ENCODERS[form].encode(SampledClip(still(card, scale), trust), convention)


def usd_rig(path, card, scale=1.2, convention=CENTIMETRES_Z):
    """Write a skinned character whose joints have turned axes, below a prim that moves it."""
    path.write_bytes(_written("usdc", card, scale, convention))
    stage = Usd.Stage.Open(str(path))
    prim = stage.GetPrimAtPath("/Character/Skel")
    stage.RemovePrim("/Character/Anim")
    prim.GetRelationship("skel:animationSource").ClearTargets(True)
    skeleton = UsdSkel.Skeleton(prim)
    turn = Gf.Matrix4d(Gf.Rotation(Gf.Quatd(TURN[0], *TURN[1:].tolist())), Gf.Vec3d(0.0))
    binds = [turn * Gf.Matrix4d(own) for own in skeleton.GetBindTransformsAttr().Get()]
    topology = UsdSkel.Topology(skeleton.GetJointsAttr().Get())
    rests = [
        own if parent < 0 else own * binds[parent].GetInverse()
        for own, parent in zip(binds, topology.GetParentIndices(), strict=True)
    ]
    skeleton.GetBindTransformsAttr().Set(Vt.Matrix4dArray(binds))
    skeleton.GetRestTransformsAttr().Set(Vt.Matrix4dArray(rests))
    up = "Y" if convention.up == "y" else "Z"
    UsdGeom.Xformable(stage.GetPrimAtPath("/Character")).AddXformOp(
        getattr(UsdGeom.XformOp, f"TypeRotate{up}")
    ).Set(20.0)
    stage.GetRootLayer().Save()


def glb_rig(path, card, scale=0.8):
    """Write a skinned character without animation, its joints below a node in centimetres."""
    document, binary = read_glb(_written("glb", card, scale))
    del document["animations"]
    nodes = document["nodes"]
    for node in nodes[:-1]:
        node["translation"] = [100.0 * own for own in node["translation"]]
    nodes.append({"name": "Armature", "scale": [0.01] * 3, "children": [0]})
    document["scenes"][0]["nodes"] = [len(nodes) - 2, len(nodes) - 1]
    text = json.dumps(document).encode()
    text = text.ljust(len(text) + -len(text) % 4)
    head = struct.pack("<3L", 0x46546C67, 2, 28 + len(text) + len(binary))
    first, second = (
        struct.pack("<2L", len(text), 0x4E4F534A),
        struct.pack("<2L", len(binary), 0x4E4942),
    )
    path.write_bytes(b"".join((head, first, text, second, binary)))


def read_glb(content):
    """Return the document and the buffer of a binary glTF file."""
    size = struct.unpack_from("<L", content, 12)[0]
    return json.loads(content[20 : 20 + size]), content[28 + size :]


def stage_positions(path, frame):
    """Return the joint positions (J, 3) of a stage at a frame, m, Y up, and the points of its mesh.

    UsdSkel and UsdGeom compute them.
    """
    stage = Usd.Stage.Open(str(path))
    root = next(prim for prim in stage.Traverse() if prim.IsA(UsdSkel.Root))
    cache = UsdSkel.Cache()
    cache.Populate(UsdSkel.Root(root), Usd.PrimDefaultPredicate)
    prim = next(prim for prim in stage.Traverse() if prim.IsA(UsdSkel.Skeleton))
    query = cache.GetSkelQuery(UsdSkel.Skeleton(prim))
    world = UsdGeom.XformCache(frame).GetLocalToWorldTransform(prim)
    joints = [own * world for own in query.ComputeJointSkelTransforms(frame)]
    unit = UsdGeom.GetStageMetersPerUnit(stage)
    up = UsdGeom.GetStageUpAxis(stage)
    points = _skinned_points(cache, root, query, world, frame)
    return tuple(unit * _y_up(found, up) for found in (np.array(joints)[:, 3, :3], points))


def stage_joints(path):
    """Return the names of the joints of a stage's skeleton."""
    stage = Usd.Stage.Open(str(path))
    prim = next(prim for prim in stage.Traverse() if prim.IsA(UsdSkel.Skeleton))
    tokens = UsdSkel.Skeleton(prim).GetJointsAttr().Get()
    return [token.rpartition("/")[2] for token in tokens]


def _skinned_points(cache, root, query, world, frame):
    found = [np.zeros((0, 3))]
    transforms = query.ComputeSkinningTransforms(frame)
    for binding in cache.ComputeSkelBindings(UsdSkel.Root(root), Usd.PrimDefaultPredicate):
        for skinned in binding.GetSkinningTargets():
            points = UsdGeom.PointBased(skinned.GetPrim()).GetPointsAttr().Get()
            points = Vt.Vec3fArray(points)
            assert skinned.ComputeSkinnedPoints(transforms, points, frame)
            matrix = np.array(world)
            found.append(np.array(points) @ matrix[:3, :3] + matrix[3, :3])
    return np.concatenate(found)


def _y_up(found, up):
    return found if up == "Y" else found[:, [0, 2, 1]] * np.array([1.0, 1.0, -1.0])


def glb_positions(content, frame):
    """Return the names of the animated nodes and their positions (J, 3) at a frame."""
    document, binary = read_glb(content)
    animation = document["animations"][0]
    nodes = [dict(node) for node in document["nodes"]]
    for channel in animation["channels"]:
        accessor = document["accessors"][animation["samplers"][channel["sampler"]]["output"]]
        view = document["bufferViews"][accessor["bufferView"]]
        width = {"VEC3": 3, "VEC4": 4}[accessor["type"]]
        start = view["byteOffset"] + accessor.get("byteOffset", 0) + 4 * width * frame
        values = np.frombuffer(binary, np.float32, width, start).astype(float)
        nodes[channel["target"]["node"]][channel["target"]["path"]] = values.tolist()
    placed = {}
    for root in document["scenes"][0]["nodes"]:
        _place(nodes, root, np.eye(4), placed)
    joints = sorted({own["target"]["node"] for own in animation["channels"]})
    return [nodes[own]["name"] for own in joints], np.array([placed[own] for own in joints])


def _place(nodes, index, above, placed):
    node = nodes[index]
    x, y, z, w = node.get("rotation", [0.0, 0.0, 0.0, 1.0])
    local = np.eye(4)
    local[:3, :3] = quat.to_matrix(np.array([w, x, y, z])) * np.array(node.get("scale", [1.0] * 3))
    local[:3, 3] = node.get("translation", [0.0] * 3)
    world = above @ local
    placed[index] = world[:3, 3]
    for child in node.get("children", []):
        _place(nodes, child, world, placed)
