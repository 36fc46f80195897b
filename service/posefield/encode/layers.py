"""USD layers: metadata, facts and binary form, and the prims of a character and its animation."""

import errno
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from pxr import Gf, Sdf, Tf, Vt

from posefield.common.errors import FileError
from posefield.common.units import Floats, Singles
from posefield.encode import character, crate_sections, skinned_mesh
from posefield.encode.character import METRES, CharacterArrays, CharacterRig, Convention
from posefield.encode.skinned_mesh import FULL_WEIGHT

Samples = Mapping[str, Singles]
"""Samples (F, ...) of attributes at the time codes 0 to F - 1, by name."""

WEIGHTS = "blendShapeWeights"
"""Name of the samples (F, C) of curves; those of other attributes are vectors (F, N, n)."""


ARRAYS = {str: Vt.StringArray, int: Vt.Int64Array, float: Vt.DoubleArray}
"""USD's array of each kind of list."""


def usd_dictionary(facts: Mapping[str, Any]) -> dict[str, Any]:
    """Return facts as values of a USD dictionary, without those that are None."""
    return {name: _usd_value(fact) for name, fact in facts.items() if fact is not None}


def _usd_value(fact: Any) -> Any:
    plain = crate_sections.plain_fact(fact)
    if isinstance(plain, tuple):
        kind, items = plain
        return ARRAYS[kind](list(items))
    return usd_dictionary(plain) if isinstance(plain, dict) else plain


FACTS = "posefield"
"""Name of a layer's facts in its custom data."""
Result = TypeVar("Result")
MEMORY_FOLDER = Path("/dev/shm")

# The first layer of a process makes usd-core load its file formats; two threads that do so at the
# same time can deadlock. A module is imported by one thread only.
Sdf.Layer.CreateAnonymous("first.usda")


def set_layer_metadata(
    layer: Any, default: str, frames: int, rate: float, convention: Convention = METRES
) -> None:
    """Set default prim, units, axes and times: frames at the time codes 0 to frames - 1.

    rate: frames a second.
    """
    layer.defaultPrim = default
    layer.startTimeCode, layer.endTimeCode = 0.0, float(frames - 1)
    # Some readers use one of the two, some the other.
    layer.timeCodesPerSecond = layer.framesPerSecond = float(rate)
    layer.pseudoRoot.SetInfo("metersPerUnit", convention.metres_per_unit)
    layer.pseudoRoot.SetInfo("upAxis", convention.up.upper())


def set_custom_data(layer: Any, facts: Mapping[str, Any]) -> None:
    """Set the custom layer data `FACTS` to facts, unless there are none."""
    if dictionary := usd_dictionary(facts):
        layer.customLayerData = {FACTS: dictionary}


def crate_bytes(layer: Any, memory: Path = MEMORY_FOLDER) -> bytes:
    """Return the layer in its binary form, which pxr can only write to a file.

    memory: folder for that file; the default folder of temporary files if it cannot be used. Raises
    FileError if neither can be written.
    """

    def exported(path: Path) -> bytes:
        export_layer(layer, path)
        return path.read_bytes()

    return _with_file(exported, memory)


def crate_text(data: bytes, memory: Path = MEMORY_FOLDER) -> str:
    """Return a binary layer as text, as usd-core reads it from a file in `memory`.

    Raises FileError as `crate_bytes` does.
    """

    def read(path: Path) -> str:
        path.write_bytes(data)
        text: str = Sdf.Layer.OpenAsAnonymous(str(path)).ExportToString()
        return text

    return _with_file(read, memory)


def _with_file(use: Callable[[Path], Result], memory: Path) -> Result:
    """Return what a function returns for the path of a file that does not exist yet."""
    try:
        return _in_folder(use, memory)
    except OSError:
        # It may be missing, full or not writable: containers have 64 MB of it.
        pass
    try:
        return _in_folder(use, None)
    except OSError as fault:
        message = f"a temporary file of usd-core cannot be written: {fault.strerror}"
        raise FileError(tempfile.gettempdir(), message) from fault


def _in_folder(use: Callable[[Path], Result], parent: Path | None) -> Result:
    with tempfile.TemporaryDirectory(dir=parent) as folder:
        return use(Path(folder, "layer.usdc"))


def export_layer(layer: Any, path: Path) -> None:
    """Write a layer as text if the path ends in .usda, and in binary form otherwise.

    Raises OSError if it cannot be written.
    """
    form = "usda" if path.suffix == ".usda" else "usdc"
    try:
        layer.Export(str(path), args={"format": form})
    except Tf.ErrorException as fault:
        raise OSError(errno.EIO, str(fault.args[0].commentary)) from fault


ValueTypes = Sdf.ValueTypeNames


def prim(parent: Any, name: str, kind: str, apis: Sequence[str] = ()) -> Any:
    """Return a new prim of a schema with applied API schemas."""
    spec = Sdf.PrimSpec(parent, name, Sdf.SpecifierDef, kind)
    if apis:
        spec.SetInfo("apiSchemas", Sdf.TokenListOp.Create(prependedItems=list(apis)))
    return spec


def varying_attribute(owner: Any, name: str, kind: Any, value: Any = None) -> Any:
    """Return a new varying attribute, with a default value unless it is None."""
    spec = Sdf.AttributeSpec(owner, name, kind)
    if value is not None:
        spec.default = value
    return spec


def uniform_attribute(owner: Any, name: str, kind: Any, value: Any = None) -> None:
    """Create an attribute that does not vary over time, with a value unless it is None."""
    spec = Sdf.AttributeSpec(owner, name, kind, Sdf.VariabilityUniform)
    if value is not None:
        spec.default = value


def vertex_attribute(owner: Any, name: str, kind: Any, value: Any = None) -> Any:
    """Return a new attribute with one element per point of a mesh."""
    spec = varying_attribute(owner, name, kind, value)
    spec.SetInfo("interpolation", "vertex")
    return spec


def add_relationship(owner: Any, name: str, *targets: Any) -> None:
    """Create a relationship to the prims at paths."""
    spec = Sdf.RelationshipSpec(owner, name, custom=False)
    spec.targetPathList.explicitItems = list(targets)


def float3_array(values: Floats) -> Any:
    """Return a float3[] of an array (N, 3)."""
    return Vt.Vec3fArray.FromNumpy(values.astype(np.float32))


def set_time_samples(prim: Any, values: Samples, first: int = 0) -> None:
    """Set the time samples of translations, rotations and weights, if any, of a SkelAnimation.

    first: time code of the first sample.
    """
    kinds = {"translations": Vt.Vec3fArray, "rotations": Vt.QuatfArray, WEIGHTS: Vt.FloatArray}
    for name, kind in kinds.items():
        if name in values:
            path = prim.path.AppendProperty(name)
            for frame, value in enumerate(map(kind.FromNumpy, values[name]), first):
                prim.layer.SetTimeSample(path, frame, value)


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
            np.ascontiguousarray(character.convert_directions(convention, mesh.normals))
        ),
        Vt.IntArray.FromNumpy(np.ascontiguousarray(mesh.joints[:, :influences]).reshape(-1)),
        Vt.FloatArray.FromNumpy(weights.reshape(-1)),
        influences,
        Vt.Vec3fArray.FromNumpy(colours),
        Vt.IntArray.FromNumpy(mesh.tints) if len(colours) > 1 else None,
    )


def add_character(
    parent: Any, name: str, rig: CharacterRig, convention: Convention = METRES
) -> Any:
    """Return a new SkelRoot with a skeleton, and a body bound to it, without numeric values."""
    skel_root = prim(parent, name, "SkelRoot", BINDING_SCHEMAS)
    skel_root.kind = "component"
    varying_attribute(skel_root, "extent", ValueTypes.Float3Array)
    skeleton = prim(skel_root, "Skel", "Skeleton", BINDING_SCHEMAS)
    add_relationship(skel_root, "skel:skeleton", skeleton.path)
    _skeleton(skeleton, rig)
    arrays = _mesh_arrays(rig, convention)
    if arrays is not None:
        mesh = prim(skel_root, "Body", "Mesh", MESH_SCHEMAS)
        add_relationship(mesh, "skel:skeleton", skeleton.path)
        _mesh(mesh, arrays)
        add_relationship(mesh, "material:binding", _material(skel_root, tinted=bool(arrays.tinted)))
    return skel_root


def usd_values(numbers: CharacterArrays) -> UsdValues:
    """Return the arrays of a character in the types of usd-core."""
    matrices = {name: Vt.Matrix4dArray.FromNumpy(numbers[name]) for name in ("bind", "rest")}
    vectors = {
        name: Vt.Vec3fArray.FromNumpy(numbers[name])
        for name in ("points", "extent")
        if name in numbers
    }
    return matrices | vectors


def set_character(root: Any, values: UsdValues) -> None:
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
    add_relationship(skeleton, "skel:animationSource", animation)


def add_blend_shapes(root: Any, rig: CharacterRig, curves: Sequence[str]) -> None:
    """Add a blend shape for each curve to the body of a SkelRoot, if it has one.

    The shapes move no point: they carry the weights to readers, in which they can be modelled.
    """
    if rig.body is None or not curves:
        return
    mesh = root.layer.GetPrimAtPath(root.path.AppendChild("Body"))
    uniform_attribute(mesh, "skel:blendShapes", ValueTypes.TokenArray, Vt.TokenArray(list(curves)))
    shapes = []
    for name in character.legal_names(curves):
        shape = prim(mesh, name, "BlendShape")
        offsets, points = Vt.Vec3fArray.FromNumpy(NO_OFFSET), Vt.IntArray([0])
        uniform_attribute(shape, "offsets", ValueTypes.Vector3fArray, offsets)
        uniform_attribute(shape, "pointIndices", ValueTypes.IntArray, points)
        shapes.append(shape.path)
    add_relationship(mesh, "skel:blendShapeTargets", *shapes)


def add_animation(
    parent: Any, name: str, paths: tuple[str, ...], curves: Sequence[str] = ()
) -> Any:
    """Return a new SkelAnimation of these joints and curves, without samples."""
    skel_animation = prim(parent, name, "SkelAnimation")
    uniform_attribute(skel_animation, "joints", ValueTypes.TokenArray, Vt.TokenArray(paths))
    varying_attribute(skel_animation, "translations", ValueTypes.Float3Array)
    varying_attribute(skel_animation, "rotations", ValueTypes.QuatfArray)
    # Without scales some readers silently show the rest pose.
    varying_attribute(
        skel_animation,
        "scales",
        ValueTypes.Half3Array,
        Vt.Vec3hArray(len(paths), Gf.Vec3h(1, 1, 1)),
    )
    if curves:
        names = Vt.TokenArray(list(curves))
        uniform_attribute(skel_animation, "blendShapes", ValueTypes.TokenArray, names)
        varying_attribute(skel_animation, WEIGHTS, ValueTypes.FloatArray)
    return skel_animation


def _attribute(root: Any, prim: str, name: str) -> Any:
    path = root.path.AppendChild(prim) if prim else root.path
    return root.layer.GetAttributeAtPath(path.AppendProperty(name))


def _skeleton(prim: Any, rig: CharacterRig) -> None:
    paths, names = Vt.TokenArray(rig.paths), Vt.TokenArray(rig.names)
    uniform_attribute(prim, "joints", ValueTypes.TokenArray, paths)
    uniform_attribute(prim, "jointNames", ValueTypes.TokenArray, names)
    for name in ("bindTransforms", "restTransforms"):
        uniform_attribute(prim, name, ValueTypes.Matrix4dArray)


def _mesh(prim: Any, arrays: _MeshArrays) -> None:
    varying_attribute(prim, "points", ValueTypes.Point3fArray)
    vertex_attribute(prim, "normals", ValueTypes.Normal3fArray, arrays.normals)
    varying_attribute(prim, "faceVertexCounts", ValueTypes.IntArray, arrays.counts)
    varying_attribute(prim, "faceVertexIndices", ValueTypes.IntArray, arrays.corners)
    uniform_attribute(prim, "subdivisionScheme", ValueTypes.Token, "none")
    varying_attribute(prim, "extent", ValueTypes.Float3Array)
    _colours(prim, arrays)
    for name, kind, value in (
        ("jointIndices", ValueTypes.IntArray, arrays.joints),
        ("jointWeights", ValueTypes.FloatArray, arrays.weights),
    ):
        vertex_attribute(prim, f"primvars:skel:{name}", kind, value).SetInfo(
            "elementSize", arrays.influences
        )
    varying_attribute(
        prim, "primvars:skel:geomBindTransform", ValueTypes.Matrix4d, Gf.Matrix4d(1.0)
    )


def _colours(prim: Any, arrays: _MeshArrays) -> None:
    """Create the colours that readers without materials show."""
    name = "primvars:displayColor"
    if arrays.tinted is None:
        spec = varying_attribute(prim, name, ValueTypes.Color3fArray, arrays.colours)
        spec.SetInfo("interpolation", "constant")
        return
    vertex_attribute(prim, name, ValueTypes.Color3fArray, arrays.colours)
    varying_attribute(prim, f"{name}:indices", ValueTypes.IntArray, arrays.tinted)


def _material(parent: Any, *, tinted: bool) -> Any:
    """Return the path of a new material in a prim.

    tinted: whether it takes its colour from the mesh instead of having one of its own.
    """
    material = prim(parent, "Material", "Material")
    surface = _shader(material, "Surface", "UsdPreviewSurface")
    colour = varying_attribute(surface, "inputs:diffuseColor", ValueTypes.Color3f)
    if tinted:
        reader = _shader(material, "Colour", PRIMVAR_READER)
        varying_attribute(reader, "inputs:varname", ValueTypes.String, "displayColor")
        colour_output = varying_attribute(reader, "outputs:result", ValueTypes.Float3)
        _connect(colour, colour_output)
    else:
        colour.default = Gf.Vec3f(*skinned_mesh.SKIN)
    for name, value in (("roughness", skinned_mesh.ROUGHNESS), ("metallic", 0.0)):
        varying_attribute(surface, f"inputs:{name}", ValueTypes.Float, value)
    output = varying_attribute(surface, "outputs:surface", ValueTypes.Token)
    _connect(varying_attribute(material, "outputs:surface", ValueTypes.Token), output)
    return material.path


def _shader(parent: Any, name: str, kind: str) -> Any:
    shader = prim(parent, name, "Shader")
    uniform_attribute(shader, "info:id", ValueTypes.Token, kind)
    return shader


def _connect(input_spec: Any, output_spec: Any) -> None:
    input_spec.connectionPathList.explicitItems = [output_spec.path]
