"""Metadata and binary form of USD layers."""

import errno
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Self, TypeVar

from pxr import Sdf, Tf

from posefield.common.errors import FileError
from posefield.encode.files.file_convention import METRES, Convention
from posefield.encode.usd_layers import custom_data
from posefield.encode.usd_layers.layer_content import LayerContent

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
    if said := custom_data.usd_dictionary(facts):
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
