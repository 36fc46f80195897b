"""Sessions of onnxruntime, each on one thread of the CPU."""

from typing import Any

import onnxruntime

from posefield.common.errors import ModelError


def open_session(content: bytes, source: str) -> Any:
    """Return a session on an ONNX file.

    Raises ModelError, which names `source` and onnxruntime's reason.
    """
    options = onnxruntime.SessionOptions()
    # A pose takes microseconds: the overhead of threads would exceed their gain.
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    options.log_severity_level = 4
    # An arena keeps the memory of the longest clip in each session and saves no time.
    options.enable_cpu_mem_arena = False
    chosen = ["CPUExecutionProvider"]
    try:
        return onnxruntime.InferenceSession(content, options, providers=chosen, enable_fallback=0)
    except Exception as fault:  # onnxruntime's exceptions share no base of their own
        raise ModelError(source, f"onnxruntime cannot load it: {first_line(fault)}") from fault


def first_line(fault: Exception) -> str:
    """Return the first line of an exception's message, or its class where it has none."""
    return next(iter(str(fault).strip().splitlines()), type(fault).__name__)
