"""Metadata and binary form of USD layers."""

import errno
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple, Self, TypeVar

import numpy as np
from pxr import Sdf, Tf, Vt

from posefield.common.errors import FileError
from posefield.encode.files.file_convention import METRES, Convention
from posefield.encode.usd_layers.layer_content import LayerContent

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
    made: Any, default: str, frames: int, rate: float, convention: Convention = METRES
) -> None:
    """Set default prim, units, axes and times: frames at the time codes 0 to frames - 1.

    rate: frames a second.
    """
    made.defaultPrim = default
    made.startTimeCode, made.endTimeCode = 0.0, float(frames - 1)
    # Some readers use one of the two, some the other.
    made.timeCodesPerSecond = made.framesPerSecond = float(rate)
    made.pseudoRoot.SetInfo("metersPerUnit", convention.metres_per_unit)
    made.pseudoRoot.SetInfo("upAxis", convention.up.upper())


def set_custom_data(made: Any, facts: Mapping[str, Any]) -> None:
    """Set the custom layer data `FACTS` to facts, unless there are none."""
    if said := usd_dictionary(facts):
        made.customLayerData = {FACTS: said}


@dataclass(frozen=True)
class BaseLayerBuilder:
    """Layers of one rate and convention."""

    rate: float
    convention: Convention

    def with_rate(self, rate: float) -> Self:
        """Return layers of another rate."""
        return replace(self, rate=rate)

    def set_metadata(self, made: Any, default: str, content: LayerContent) -> None:
        """Set the metadata of a layer, with this default prim, and the facts of its content."""
        set_layer_metadata(made, default, content.frames, self.rate, self.convention)
        set_custom_data(made, content.facts)


def crate_bytes(made: Any, memory: Path = MEMORY_FOLDER) -> bytes:
    """Return the layer in its binary form, which pxr can only write to a file.

    memory: folder for that file; the default folder of temporary files if it cannot be used. Raises
    FileError if neither can be written.
    """

    def exported(path: Path) -> bytes:
        export_layer(made, path)
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


def _in_folder(use: Callable[[Path], Result], place: Path | None) -> Result:
    with tempfile.TemporaryDirectory(dir=place) as folder:
        return use(Path(folder, "layer.usdc"))


def export_layer(made: Any, path: Path) -> None:
    """Write a layer as text if the path ends in .usda, and in binary form otherwise.

    Raises OSError if it cannot be written.
    """
    form = "usda" if path.suffix == ".usda" else "usdc"
    try:
        made.Export(str(path), args={"format": form})
    except Tf.ErrorException as fault:
        raise OSError(errno.EIO, str(fault.args[0].commentary)) from fault
