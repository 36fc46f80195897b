"""USD layers: their metadata, facts and binary form, and helpers that write prims into them."""

import errno
import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from pxr import Sdf, Tf, Vt

from posefield.common.errors import FileError
from posefield.common.units import Floats, Singles
from posefield.encode import crate_sections
from posefield.encode.conventions import METRES, Convention

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
