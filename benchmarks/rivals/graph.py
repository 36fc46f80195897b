"""The model's graph as rivals ask it: one thread, all that a pose is."""

import os
from collections.abc import Callable
from typing import Any

os.environ["ORT_DISABLE_TELEMETRY"] = "1"

import onnxruntime

OUTPUTS = ("rotations", "root_position", "bone_offsets", "duration", "sigma")


def opened(path: str) -> Callable[[dict[str, Any]], list[Any]]:
    """Function from inputs by name to the outputs in their order."""
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    options.log_severity_level = 4
    session: Any = onnxruntime.InferenceSession(path, options, providers=["CPUExecutionProvider"])
    return lambda feed: session.run(OUTPUTS, feed)
