"""USD prims of a character: its skeleton, its skinned body and its animation."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from pxr import Gf, Vt

from posefield.encode.character import body_mesh
from posefield.encode.character.character import Numbers, Rig
from posefield.encode.usd import prim_specs
from posefield.encode.usd.prim_specs import Type

BINDING = ("SkelBindingAPI",)

Values = Mapping[str, Any]
"""Arrays of `Numbers` by the same names, in types of usd-core, whose copies share their memory."""


@dataclass(frozen=True)
class _Arrays:
    """Arrays of a rig that all its characters share, as usd-core's own."""

    paths: Any
    names: Any
    counts: Any
    corners: Any
    tints: Any
    tinted: Any
    joints: Any
    weights: Any


@lru_cache(maxsize=64)
def _arrays(rig: Rig) -> _Arrays:
    counts, corners = map(Vt.IntArray.FromNumpy, body_mesh.faces(rig.bones))
    joints = np.repeat(rig.bones.joints, body_mesh.POINTS)
    return _Arrays(
        Vt.TokenArray(rig.paths),
        Vt.TokenArray(rig.names),
        counts,
        corners,
        prim_specs.vectors(body_mesh.TINTS),
        Vt.IntArray.FromNumpy(np.repeat(rig.bones.tints, body_mesh.POINTS)),
        Vt.IntArray.FromNumpy(joints),
        Vt.FloatArray(len(joints), 1.0),
    )


def root(parent: Any, name: str, rig: Rig) -> Any:
    """Return a new SkelRoot with a skeleton and a body bound to it, without numeric values."""
    made = prim_specs.prim(parent, name, "SkelRoot", BINDING)
    made.kind = "component"
    prim_specs.attribute(made, "extent", Type.Float3Array)
    skeleton = prim_specs.prim(made, "Skel", "Skeleton", BINDING)
    mesh = prim_specs.prim(made, "Body", "Mesh", BINDING)
    for bound in (made, mesh):
        prim_specs.relation(bound, "skel:skeleton", skeleton.path)
    arrays = _arrays(rig)
    _skeleton(skeleton, arrays)
    _mesh(mesh, arrays)
    return made


def values(numbers: Numbers) -> Values:
    """Return the arrays of a character in the types of usd-core."""
    made = {name: Vt.Matrix4dArray.FromNumpy(numbers[name]) for name in ("bind", "rest")}
    vectors = {
        name: Vt.Vec3fArray.FromNumpy(numbers[name]) for name in ("points", "normals", "extent")
    }
    return made | vectors


def fill(root: Any, values: Values) -> None:
    """Set the arrays of a SkelRoot, its skeleton and its body."""
    for prim in ("", "Body"):
        _attribute(root, prim, "extent").default = values["extent"]
    for name, key in (("bindTransforms", "bind"), ("restTransforms", "rest")):
        _attribute(root, "Skel", name).default = values[key]
    for name in ("points", "normals"):
        _attribute(root, "Body", name).default = values[name]


def bind(root: Any, animation: Any) -> None:
    """Bind the skeleton of a SkelRoot to the SkelAnimation at a path."""
    skeleton = root.layer.GetPrimAtPath(root.path.AppendChild("Skel"))
    prim_specs.relation(skeleton, "skel:animationSource", animation)


def animation(parent: Any, name: str, paths: tuple[str, ...]) -> Any:
    """Return a new SkelAnimation of these joints, without samples of translations and rotations."""
    made = prim_specs.prim(parent, name, "SkelAnimation")
    prim_specs.uniform(made, "joints", Type.TokenArray, Vt.TokenArray(paths))
    prim_specs.attribute(made, "translations", Type.Float3Array)
    prim_specs.attribute(made, "rotations", Type.QuatfArray)
    # Without scales some readers silently show the rest pose.
    prim_specs.attribute(
        made, "scales", Type.Half3Array, Vt.Vec3hArray(len(paths), Gf.Vec3h(1, 1, 1))
    )
    return made


def _attribute(root: Any, prim: str, name: str) -> Any:
    path = root.path.AppendChild(prim) if prim else root.path
    return root.layer.GetAttributeAtPath(path.AppendProperty(name))


def _skeleton(prim: Any, arrays: _Arrays) -> None:
    prim_specs.uniform(prim, "joints", Type.TokenArray, arrays.paths)
    prim_specs.uniform(prim, "jointNames", Type.TokenArray, arrays.names)
    for name in ("bindTransforms", "restTransforms"):
        prim_specs.uniform(prim, name, Type.Matrix4dArray)


def _mesh(prim: Any, arrays: _Arrays) -> None:
    prim_specs.attribute(prim, "points", Type.Point3fArray)
    prim_specs.per_point(prim, "normals", Type.Normal3fArray)
    prim_specs.attribute(prim, "faceVertexCounts", Type.IntArray, arrays.counts)
    prim_specs.attribute(prim, "faceVertexIndices", Type.IntArray, arrays.corners)
    prim_specs.uniform(prim, "subdivisionScheme", Type.Token, "none")
    prim_specs.attribute(prim, "extent", Type.Float3Array)
    prim_specs.per_point(prim, "primvars:displayColor", Type.Color3fArray, arrays.tints)
    prim_specs.attribute(prim, "primvars:displayColor:indices", Type.IntArray, arrays.tinted)
    for name, kind, value in (
        ("jointIndices", Type.IntArray, arrays.joints),
        ("jointWeights", Type.FloatArray, arrays.weights),
    ):
        prim_specs.per_point(prim, f"primvars:skel:{name}", kind, value).SetInfo("elementSize", 1)
    prim_specs.attribute(prim, "primvars:skel:geomBindTransform", Type.Matrix4d, Gf.Matrix4d(1.0))
