"""The head of a layer, and its bytes."""

import errno
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pxr import Sdf, Tf

from service.encode import facts
from service.encode.content import Content
from service.encode.convention import METRES, Convention

MEMORY = Path("/dev/shm")

# The first layer of a process makes usd-core load its formats, and of two threads that do so at
# once each can wait for the other for ever. Modules are imported by one.
Sdf.Layer.CreateAnonymous("first.usda")


def head(
    made: Any, default: str, frames: int, rate: float, convention: Convention = METRES
) -> None:
    """State default prim, units, axes and times: frames at the time codes 0 to frames - 1."""
    made.defaultPrim = default
    made.startTimeCode, made.endTimeCode = 0.0, float(frames - 1)
    # Readers differ in which of the two they believe.
    made.timeCodesPerSecond = made.framesPerSecond = float(rate)
    made.pseudoRoot.SetInfo("metersPerUnit", convention.metres_per_unit)
    made.pseudoRoot.SetInfo("upAxis", convention.up.upper())


def say(made: Any, said: Mapping[str, Any]) -> None:
    """State facts where there are any."""
    if said:
        made.customLayerData = {"posefield": dict(said)}


@dataclass(frozen=True)
class Kind:
    """Layers of one rate and convention."""

    rate: float
    convention: Convention

    @property
    def numbers(self) -> tuple[float, ...]:
        """Those that every layer holds."""
        return (self.rate, self.convention.metres_per_unit)

    def state(self, made: Any, default: str, content: Content) -> None:
        """Give a layer its head, with this default prim, and the facts of its content."""
        head(made, default, content.frames, self.rate, self.convention)
        say(made, facts.dictionary(content.facts.whole()))


def crate(made: Any) -> bytes:
    """The layer in its binary form, which pxr can only write to a file."""
    try:
        return _written(made, MEMORY)
    except OSError:
        # It may be missing, full or not ours: containers have 64 MB.
        return _written(made, None)


def _written(made: Any, place: Path | None) -> bytes:
    with tempfile.TemporaryDirectory(dir=place) as folder:
        path = Path(folder, "layer.usdc")
        export(made, path)
        return path.read_bytes()


def export(made: Any, path: Path) -> None:
    """Write a layer as text where the path ends in .usda, and in binary form else.

    Raises OSError where it cannot be, like all that writes.
    """
    form = "usda" if path.suffix == ".usda" else "usdc"
    try:
        made.Export(str(path), args={"format": form})
    except Tf.ErrorException as fault:
        raise OSError(errno.EIO, str(fault.args[0].commentary)) from fault
