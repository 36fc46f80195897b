"""USD layers: their content, metadata and binary form, and helpers that write prims into them."""

import errno
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple, Protocol, Self, TypeVar

import numpy as np
import numpy.typing as npt
from pxr import Sdf, Tf, Vt

from posefield.common.errors import FileError
from posefield.common.units import Floats, Singles
from posefield.encode.conventions import METRES, Convention

Array = npt.NDArray[Any]
Samples = Mapping[str, Singles]
"""Samples (F, ...) of attributes at the time codes 0 to F - 1, by name."""

WEIGHTS = "blendShapeWeights"
"""Name of the samples (F, C) of curves; those of other attributes are vectors (F, N, n)."""


class LayerPattern(NamedTuple):
    """Shapes of a content.

    samples: name and shape. values: name, shape and type. facts: whether it has any.
    """

    samples: tuple[tuple[str, tuple[int, ...]], ...]
    values: tuple[tuple[str, tuple[int, ...], str], ...]
    facts: bool


@dataclass(frozen=True)
class LayerContent:
    """Content of a layer: samples of attributes, values by name, and facts.

    No number is -0: it counts as equal to 0, and equal samples are stored once.
    """

    samples: Samples
    values: Mapping[str, Array]
    facts: Mapping[str, Any]

    @property
    def frames(self) -> int:
        """Return the number of samples of each attribute."""
        return len(next(iter(self.samples.values())))

    @property
    def pattern(self) -> LayerPattern:
        """Return the shapes of the content."""
        return LayerPattern(
            tuple((name, rows.shape) for name, rows in self.samples.items()),
            tuple((name, array.shape, array.dtype.char) for name, array in self.values.items()),
            bool(self.facts),
        )


class LayerBuilder(Protocol):
    """Kind of layer; equal kinds build equal layers of equal content."""

    @property
    def rate(self) -> float:
        """Return the frames a second."""

    def with_rate(self, rate: float) -> Self:
        """Return the same kind at other frames a second."""

    def layer(self, content: LayerContent) -> Any:
        """Return the layer, built by usd-core; its prims are valid while the caller holds it."""

    def __hash__(self) -> int: ...


def first_frame(content: LayerContent) -> LayerContent:
    """Return the content with the first sample of each attribute alone."""
    return replace(content, samples={name: rows[:1] for name, rows in content.samples.items()})


def random_content(pattern: LayerPattern, facts: Mapping[str, Any], seed: int) -> LayerContent:
    """Return a content of these shapes with these facts, and values at random that all differ."""
    rng = np.random.default_rng(seed)
    samples = {name: rng.standard_normal(shape, np.float32) for name, shape in pattern.samples}
    values = {n: rng.standard_normal(shape).astype(kind) for n, shape, kind in pattern.values}
    return LayerContent(samples, values, facts)


LARGEST_INTEGER = 2**63 - 1
"""Largest integer that every reader of a layer supports."""


class FactList(NamedTuple):
    """A list of facts of one kind: str, int or float."""

    kind: type
    items: tuple[Any, ...]


ARRAYS = {str: Vt.StringArray, int: Vt.Int64Array, float: Vt.DoubleArray}
"""USD's array of each kind of list."""


def usd_dictionary(facts: Mapping[str, Any]) -> dict[str, Any]:
    """Return facts as values of a USD dictionary, without those that are None."""
    return {name: _usd_value(fact) for name, fact in facts.items() if fact is not None}


def plain_fact(fact: Any) -> Any:
    """Return a fact as what USD holds: a text, truth or number, a list of one kind, a dictionary.

    A mixed list is a dictionary by index, and an integer that readers do not support a text. Raises
    TypeError for any other value.
    """
    match fact:
        case np.generic() | np.ndarray():
            return plain_fact(fact.tolist())
        case Mapping():
            return dict(fact)
        case str():
            return str(fact)
        case bool():
            return fact
        case float():
            return float(fact)
        case int():
            return int(fact) if _is_supported(fact) else str(int(fact))
        case Sequence():
            return _plain_list(fact)
    raise TypeError(f"a fact of type {type(fact).__name__}, expected text, a number or several")


def _plain_list(facts: Sequence[Any]) -> FactList | dict[str, Any]:
    if all(isinstance(fact, str) for fact in facts):
        return FactList(str, tuple(facts))
    if all(_is_supported(fact) for fact in facts):
        return FactList(int, tuple(facts))
    if all(isinstance(fact, float | int) for fact in facts):
        return FactList(float, tuple(facts))
    return {str(index): fact for index, fact in enumerate(facts)}


def _is_supported(fact: Any) -> bool:
    return isinstance(fact, int) and abs(fact) <= LARGEST_INTEGER


def _usd_value(fact: Any) -> Any:
    plain = plain_fact(fact)
    if isinstance(plain, FactList):
        return ARRAYS[plain.kind](list(plain.items))
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


@dataclass(frozen=True)
class BaseLayerBuilder:
    """Layers of one rate and convention."""

    rate: float
    convention: Convention

    def with_rate(self, rate: float) -> Self:
        """Return layers of another rate."""
        return replace(self, rate=rate)

    def set_metadata(self, layer: Any, default: str, content: LayerContent) -> None:
        """Set the metadata of a layer, with this default prim, and the facts of its content."""
        set_layer_metadata(layer, default, content.frames, self.rate, self.convention)
        set_custom_data(layer, content.facts)


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
