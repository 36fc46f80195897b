"""USD prims of a character: its skeleton, its skinned body and its animation."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from pxr import Gf, Vt

from posefield.encode.character import body_mesh
from posefield.encode.character.character import CharacterArrays, CharacterRig
from posefield.encode.usd import prim_specs
from posefield.encode.usd.prim_specs import ValueTypes

BINDING_SCHEMAS = ("SkelBindingAPI",)

UsdValues = Mapping[str, Any]
"""Arrays of `Numbers` by the same names, in types of usd-core, whose copies share their memory."""


@dataclass(frozen=True)
class _RigArrays:
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
def _rig_arrays(rig: CharacterRig) -> _RigArrays:
    counts, corners = map(Vt.IntArray.FromNumpy, body_mesh.faces(rig.bones))
    joints = np.repeat(rig.bones.joints, body_mesh.POINTS_PER_BOX)
    return _RigArrays(
        Vt.TokenArray(rig.paths),
        Vt.TokenArray(rig.names),
        counts,
        corners,
        prim_specs.float3_array(body_mesh.TINTS),
        Vt.IntArray.FromNumpy(np.repeat(rig.bones.tints, body_mesh.POINTS_PER_BOX)),
        Vt.IntArray.FromNumpy(joints),
        Vt.FloatArray(len(joints), 1.0),
    )


def root(parent: Any, name: str, rig: CharacterRig) -> Any:
    """Return a new SkelRoot with a skeleton and a body bound to it, without numeric values."""
    made = prim_specs.prim(parent, name, "SkelRoot", BINDING_SCHEMAS)
    made.kind = "component"
    prim_specs.varying_attribute(made, "extent", ValueTypes.Float3Array)
    skeleton = prim_specs.prim(made, "Skel", "Skeleton", BINDING_SCHEMAS)
    mesh = prim_specs.prim(made, "Body", "Mesh", BINDING_SCHEMAS)
    for bound in (made, mesh):
        prim_specs.add_relationship(bound, "skel:skeleton", skeleton.path)
    arrays = _rig_arrays(rig)
    _skeleton(skeleton, arrays)
    _mesh(mesh, arrays)
    return made


def values(numbers: CharacterArrays) -> UsdValues:
    """Return the arrays of a character in the types of usd-core."""
    made = {name: Vt.Matrix4dArray.FromNumpy(numbers[name]) for name in ("bind", "rest")}
    vectors = {
        name: Vt.Vec3fArray.FromNumpy(numbers[name]) for name in ("points", "normals", "extent")
    }
    return made | vectors


def set_values(root: Any, values: UsdValues) -> None:
    """Set the arrays of a SkelRoot, its skeleton and its body."""
    for prim in ("", "Body"):
        _attribute(root, prim, "extent").default = values["extent"]
    for name, key in (("bindTransforms", "bind"), ("restTransforms", "rest")):
        _attribute(root, "Skel", name).default = values[key]
    for name in ("points", "normals"):
        _attribute(root, "Body", name).default = values[name]


def bind_animation(root: Any, animation: Any) -> None:
    """Bind the skeleton of a SkelRoot to the SkelAnimation at a path."""
    skeleton = root.layer.GetPrimAtPath(root.path.AppendChild("Skel"))
    prim_specs.add_relationship(skeleton, "skel:animationSource", animation)


def animation(parent: Any, name: str, paths: tuple[str, ...]) -> Any:
    """Return a new SkelAnimation of these joints, without samples of translations and rotations."""
    made = prim_specs.prim(parent, name, "SkelAnimation")
    prim_specs.uniform_attribute(made, "joints", ValueTypes.TokenArray, Vt.TokenArray(paths))
    prim_specs.varying_attribute(made, "translations", ValueTypes.Float3Array)
    prim_specs.varying_attribute(made, "rotations", ValueTypes.QuatfArray)
    # Without scales some readers silently show the rest pose.
    prim_specs.varying_attribute(
        made, "scales", ValueTypes.Half3Array, Vt.Vec3hArray(len(paths), Gf.Vec3h(1, 1, 1))
    )
    return made


def _attribute(root: Any, prim: str, name: str) -> Any:
    path = root.path.AppendChild(prim) if prim else root.path
    return root.layer.GetAttributeAtPath(path.AppendProperty(name))


def _skeleton(prim: Any, arrays: _RigArrays) -> None:
    prim_specs.uniform_attribute(prim, "joints", ValueTypes.TokenArray, arrays.paths)
    prim_specs.uniform_attribute(prim, "jointNames", ValueTypes.TokenArray, arrays.names)
    for name in ("bindTransforms", "restTransforms"):
        prim_specs.uniform_attribute(prim, name, ValueTypes.Matrix4dArray)


def _mesh(prim: Any, arrays: _RigArrays) -> None:
    prim_specs.varying_attribute(prim, "points", ValueTypes.Point3fArray)
    prim_specs.vertex_attribute(prim, "normals", ValueTypes.Normal3fArray)
    prim_specs.varying_attribute(prim, "faceVertexCounts", ValueTypes.IntArray, arrays.counts)
    prim_specs.varying_attribute(prim, "faceVertexIndices", ValueTypes.IntArray, arrays.corners)
    prim_specs.uniform_attribute(prim, "subdivisionScheme", ValueTypes.Token, "none")
    prim_specs.varying_attribute(prim, "extent", ValueTypes.Float3Array)
    prim_specs.vertex_attribute(
        prim, "primvars:displayColor", ValueTypes.Color3fArray, arrays.tints
    )
    prim_specs.varying_attribute(
        prim, "primvars:displayColor:indices", ValueTypes.IntArray, arrays.tinted
    )
    for name, kind, value in (
        ("jointIndices", ValueTypes.IntArray, arrays.joints),
        ("jointWeights", ValueTypes.FloatArray, arrays.weights),
    ):
        prim_specs.vertex_attribute(prim, f"primvars:skel:{name}", kind, value).SetInfo(
            "elementSize", 1
        )
    prim_specs.varying_attribute(
        prim, "primvars:skel:geomBindTransform", ValueTypes.Matrix4d, Gf.Matrix4d(1.0)
    )
