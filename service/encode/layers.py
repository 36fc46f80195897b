"""The head of a layer, and its bytes."""

import tempfile
from pathlib import Path
from typing import Any

MEMORY = Path("/dev/shm")


def head(made: Any, default: str, frames: int, rate: float) -> None:
    """State default prim, units, axes and times: frames at the time codes 0 to frames - 1."""
    made.defaultPrim = default
    made.startTimeCode, made.endTimeCode = 0.0, float(frames - 1)
    # Readers differ in which of the two they believe.
    made.timeCodesPerSecond = made.framesPerSecond = float(rate)
    made.pseudoRoot.SetInfo("metersPerUnit", 1.0)
    made.pseudoRoot.SetInfo("upAxis", "Y")


def crate(made: Any) -> bytes:
    """The layer in its binary form, which pxr can only write to a file."""
    with tempfile.TemporaryDirectory(dir=MEMORY if MEMORY.is_dir() else None) as folder:
        path = Path(folder, "layer.usdc")
        made.Export(str(path), args={"format": "usdc"})
        return path.read_bytes()
