"""Motion models: `load` and `perform` answer in this process, `posefield serve` over HTTP."""

import os
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from posefield.common.errors import MotionError as MotionError
    from posefield.model import Clip as Clip
    from posefield.model import Crowd as Crowd
    from posefield.model import Model as Model
    from posefield.model import Performance as Performance
    from posefield.model import load as load
    from posefield.model import perform as perform

# onnxruntime's Linux wheels report to their vendor unless told otherwise before they are imported.
os.environ["ORT_DISABLE_TELEMETRY"] = "1"

__version__ = "0.3.0"
__all__ = ["Clip", "Crowd", "Model", "MotionError", "Performance", "load", "perform"]


def __getattr__(name: str) -> Any:
    # NumPy and onnxruntime are imported at the first use, so that `import posefield` is light.
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from posefield import model
    from posefield.common import errors

    return getattr(errors if name == "MotionError" else model, name)
