"""USD prims of a character: its skeleton, its skinned body and its animation."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from pxr import Gf, Vt

from posefield.encode import character, conventions, layers, skinned_mesh
from posefield.encode.character import CharacterArrays, CharacterRig
from posefield.encode.conventions import METRES, Convention
from posefield.encode.layers import WEIGHTS, ValueTypes
from posefield.encode.skinned_mesh import FULL_WEIGHT

BINDING_SCHEMAS = ("SkelBindingAPI",)
PRIMVAR_READER = "UsdPrimvarReader_float3"
NO_OFFSET = np.zeros((1, 3), np.float32)
"""Displacement of the only point of a blend shape that moves none."""
MESH_SCHEMAS = ("SkelBindingAPI", "MaterialBindingAPI")

UsdValues = Mapping[str, Any]
"""`CharacterArrays` in types of usd-core, whose copies share their memory."""


@dataclass(frozen=True)
class _MeshArrays:
    """Arrays of a body that all characters of a rig share, as usd-core's own."""

    counts: Any
    corners: Any
    normals: Any
    joints: Any
    weights: Any
    influences: int
    colours: Any
    tinted: Any


@lru_cache(maxsize=64)
def _mesh_arrays(rig: CharacterRig, convention: Convention) -> _MeshArrays | None:
    mesh = rig.body
    if mesh is None:
        return None
    influences = max(1, int(np.flatnonzero(mesh.weights.any(axis=0)).max(initial=0)) + 1)
    weights = mesh.weights[:, :influences].astype(np.float32) / np.float32(FULL_WEIGHT)
    colours = skinned_mesh.colours(mesh)
    return _MeshArrays(
        Vt.IntArray.FromNumpy(mesh.counts),
        Vt.IntArray.FromNumpy(mesh.corners),
        Vt.Vec3fArray.FromNumpy(
            np.ascontiguousarray(conventions.convert_directions(convention, mesh.normals))
        ),
        Vt.IntArray.FromNumpy(np.ascontiguousarray(mesh.joints[:, :influences]).reshape(-1)),
        Vt.FloatArray.FromNumpy(weights.reshape(-1)),
        influences,
        Vt.Vec3fArray.FromNumpy(colours),
        Vt.IntArray.FromNumpy(mesh.tints) if len(colours) > 1 else None,
    )


def root(parent: Any, name: str, rig: CharacterRig, convention: Convention = METRES) -> Any:
    """Return a new SkelRoot with a skeleton, and a body bound to it, without numeric values."""
    skel_root = layers.prim(parent, name, "SkelRoot", BINDING_SCHEMAS)
    skel_root.kind = "component"
    layers.varying_attribute(skel_root, "extent", ValueTypes.Float3Array)
    skeleton = layers.prim(skel_root, "Skel", "Skeleton", BINDING_SCHEMAS)
    layers.add_relationship(skel_root, "skel:skeleton", skeleton.path)
    _skeleton(skeleton, rig)
    arrays = _mesh_arrays(rig, convention)
    if arrays is not None:
        mesh = layers.prim(skel_root, "Body", "Mesh", MESH_SCHEMAS)
        layers.add_relationship(mesh, "skel:skeleton", skeleton.path)
        _mesh(mesh, arrays)
        layers.add_relationship(
            mesh, "material:binding", _material(skel_root, tinted=bool(arrays.tinted))
        )
    return skel_root


def values(numbers: CharacterArrays) -> UsdValues:
    """Return the arrays of a character in the types of usd-core."""
    matrices = {name: Vt.Matrix4dArray.FromNumpy(numbers[name]) for name in ("bind", "rest")}
    vectors = {
        name: Vt.Vec3fArray.FromNumpy(numbers[name])
        for name in ("points", "extent")
        if name in numbers
    }
    return matrices | vectors


def set_values(root: Any, values: UsdValues) -> None:
    """Set the arrays of a SkelRoot, its skeleton and its body."""
    prims = ("", "Body") if "points" in values else ("",)
    for prim in prims:
        _attribute(root, prim, "extent").default = values["extent"]
    for name, key in (("bindTransforms", "bind"), ("restTransforms", "rest")):
        _attribute(root, "Skel", name).default = values[key]
    if "points" in values:
        _attribute(root, "Body", "points").default = values["points"]


def bind_animation(root: Any, animation: Any) -> None:
    """Bind the skeleton of a SkelRoot to the SkelAnimation at a path."""
    skeleton = root.layer.GetPrimAtPath(root.path.AppendChild("Skel"))
    layers.add_relationship(skeleton, "skel:animationSource", animation)


def add_blend_shapes(root: Any, rig: CharacterRig, curves: Sequence[str]) -> None:
    """Add a blend shape for each curve to the body of a SkelRoot, if it has one.

    The shapes move no point: they carry the weights to readers, in which they can be modelled.
    """
    if rig.body is None or not curves:
        return
    mesh = root.layer.GetPrimAtPath(root.path.AppendChild("Body"))
    layers.uniform_attribute(
        mesh, "skel:blendShapes", ValueTypes.TokenArray, Vt.TokenArray(list(curves))
    )
    shapes = []
    for name in character.legal_names(curves):
        shape = layers.prim(mesh, name, "BlendShape")
        offsets, points = Vt.Vec3fArray.FromNumpy(NO_OFFSET), Vt.IntArray([0])
        layers.uniform_attribute(shape, "offsets", ValueTypes.Vector3fArray, offsets)
        layers.uniform_attribute(shape, "pointIndices", ValueTypes.IntArray, points)
        shapes.append(shape.path)
    layers.add_relationship(mesh, "skel:blendShapeTargets", *shapes)


def animation(parent: Any, name: str, paths: tuple[str, ...], curves: Sequence[str] = ()) -> Any:
    """Return a new SkelAnimation of these joints and curves, without samples."""
    skel_animation = layers.prim(parent, name, "SkelAnimation")
    layers.uniform_attribute(skel_animation, "joints", ValueTypes.TokenArray, Vt.TokenArray(paths))
    layers.varying_attribute(skel_animation, "translations", ValueTypes.Float3Array)
    layers.varying_attribute(skel_animation, "rotations", ValueTypes.QuatfArray)
    # Without scales some readers silently show the rest pose.
    layers.varying_attribute(
        skel_animation,
        "scales",
        ValueTypes.Half3Array,
        Vt.Vec3hArray(len(paths), Gf.Vec3h(1, 1, 1)),
    )
    if curves:
        names = Vt.TokenArray(list(curves))
        layers.uniform_attribute(skel_animation, "blendShapes", ValueTypes.TokenArray, names)
        layers.varying_attribute(skel_animation, WEIGHTS, ValueTypes.FloatArray)
    return skel_animation


def _attribute(root: Any, prim: str, name: str) -> Any:
    path = root.path.AppendChild(prim) if prim else root.path
    return root.layer.GetAttributeAtPath(path.AppendProperty(name))


def _skeleton(prim: Any, rig: CharacterRig) -> None:
    paths, names = Vt.TokenArray(rig.paths), Vt.TokenArray(rig.names)
    layers.uniform_attribute(prim, "joints", ValueTypes.TokenArray, paths)
    layers.uniform_attribute(prim, "jointNames", ValueTypes.TokenArray, names)
    for name in ("bindTransforms", "restTransforms"):
        layers.uniform_attribute(prim, name, ValueTypes.Matrix4dArray)


def _mesh(prim: Any, arrays: _MeshArrays) -> None:
    layers.varying_attribute(prim, "points", ValueTypes.Point3fArray)
    layers.vertex_attribute(prim, "normals", ValueTypes.Normal3fArray, arrays.normals)
    layers.varying_attribute(prim, "faceVertexCounts", ValueTypes.IntArray, arrays.counts)
    layers.varying_attribute(prim, "faceVertexIndices", ValueTypes.IntArray, arrays.corners)
    layers.uniform_attribute(prim, "subdivisionScheme", ValueTypes.Token, "none")
    layers.varying_attribute(prim, "extent", ValueTypes.Float3Array)
    _colours(prim, arrays)
    for name, kind, value in (
        ("jointIndices", ValueTypes.IntArray, arrays.joints),
        ("jointWeights", ValueTypes.FloatArray, arrays.weights),
    ):
        layers.vertex_attribute(prim, f"primvars:skel:{name}", kind, value).SetInfo(
            "elementSize", arrays.influences
        )
    layers.varying_attribute(
        prim, "primvars:skel:geomBindTransform", ValueTypes.Matrix4d, Gf.Matrix4d(1.0)
    )


def _colours(prim: Any, arrays: _MeshArrays) -> None:
    """Create the colours that readers without materials show."""
    name = "primvars:displayColor"
    if arrays.tinted is None:
        spec = layers.varying_attribute(prim, name, ValueTypes.Color3fArray, arrays.colours)
        spec.SetInfo("interpolation", "constant")
        return
    layers.vertex_attribute(prim, name, ValueTypes.Color3fArray, arrays.colours)
    layers.varying_attribute(prim, f"{name}:indices", ValueTypes.IntArray, arrays.tinted)


def _material(parent: Any, *, tinted: bool) -> Any:
    """Return the path of a new material in a prim.

    tinted: whether it takes its colour from the mesh instead of having one of its own.
    """
    material = layers.prim(parent, "Material", "Material")
    surface = _shader(material, "Surface", "UsdPreviewSurface")
    colour = layers.varying_attribute(surface, "inputs:diffuseColor", ValueTypes.Color3f)
    if tinted:
        reader = _shader(material, "Colour", PRIMVAR_READER)
        layers.varying_attribute(reader, "inputs:varname", ValueTypes.String, "displayColor")
        colour_output = layers.varying_attribute(reader, "outputs:result", ValueTypes.Float3)
        _connect(colour, colour_output)
    else:
        colour.default = Gf.Vec3f(*skinned_mesh.SKIN)
    for name, value in (("roughness", skinned_mesh.ROUGHNESS), ("metallic", 0.0)):
        layers.varying_attribute(surface, f"inputs:{name}", ValueTypes.Float, value)
    output = layers.varying_attribute(surface, "outputs:surface", ValueTypes.Token)
    _connect(layers.varying_attribute(material, "outputs:surface", ValueTypes.Token), output)
    return material.path


def _shader(parent: Any, name: str, kind: str) -> Any:
    shader = layers.prim(parent, name, "Shader")
    layers.uniform_attribute(shader, "info:id", ValueTypes.Token, kind)
    return shader


def _connect(input_spec: Any, output_spec: Any) -> None:
    input_spec.connectionPathList.explicitItems = [output_spec.path]
