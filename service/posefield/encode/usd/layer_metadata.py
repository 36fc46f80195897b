"""Metadata and binary form of USD layers."""

import errno
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pxr import Sdf, Tf

from posefield.common.errors import FileError
from posefield.encode.files.file_convention import METRES, Convention
from posefield.encode.usd import custom_data
from posefield.encode.usd.layer_content import LayerContent

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


def set_custom_data(made: Any, said: Mapping[str, Any]) -> None:
    """Set the custom layer data `posefield` to facts, unless there are none."""
    if said:
        made.customLayerData = {"posefield": dict(said)}


@dataclass(frozen=True)
class BaseLayerBuilder:
    """Layers of one rate and convention."""

    rate: float
    convention: Convention

    @property
    def numbers(self) -> tuple[float, ...]:
        """Return the numbers that every layer holds."""
        return (self.rate, self.convention.metres_per_unit)

    def set_metadata(self, made: Any, default: str, content: LayerContent) -> None:
        """Set the metadata of a layer, with this default prim, and the facts of its content."""
        set_layer_metadata(made, default, content.frames, self.rate, self.convention)
        set_custom_data(made, custom_data.usd_dictionary(content.facts.join()))


def crate_bytes(made: Any, memory: Path = MEMORY_FOLDER) -> bytes:
    """Return the layer in its binary form, which pxr can only write to a file.

    memory: folder for that file; the default folder of temporary files if it cannot be used. Raises
    FileError if neither can be written.
    """
    try:
        return _exported_bytes(made, memory)
    except OSError:
        # It may be missing, full or not writable: containers have 64 MB of it.
        pass
    try:
        return _exported_bytes(made, None)
    except OSError as fault:
        message = f"a temporary file of usd-core cannot be written: {fault.strerror}"
        raise FileError(tempfile.gettempdir(), message) from fault


def _exported_bytes(made: Any, place: Path | None) -> bytes:
    with tempfile.TemporaryDirectory(dir=place) as folder:
        path = Path(folder, "layer.usdc")
        export_layer(made, path)
        return path.read_bytes()


def export_layer(made: Any, path: Path) -> None:
    """Write a layer as text if the path ends in .usda, and in binary form otherwise.

    Raises OSError if it cannot be written.
    """
    form = "usda" if path.suffix == ".usda" else "usdc"
    try:
        made.Export(str(path), args={"format": form})
    except Tf.ErrorException as fault:
        raise OSError(errno.EIO, str(fault.args[0].commentary)) from fault
