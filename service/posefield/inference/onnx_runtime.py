"""Sessions of onnxruntime, each on one thread."""

from collections.abc import Callable, Sequence
from typing import Any

import onnxruntime

from posefield.common.errors import ModelError


class LazySessions(Sequence[Any]):
    """Sessions, one for each level of detail, each opened on first use.

    Two threads that open a level at the same time each open a session; one of them is kept.
    """

    def __init__(self, opened: Callable[[int], Any], count: int) -> None:
        self._open = opened
        self._sessions: list[Any] = [None] * count

    def __len__(self) -> int:
        return len(self._sessions)

    # Typed for single levels: slices are not used.
    def __getitem__(self, level: Any) -> Any:
        held = self._sessions[level]
        if held is None:
            held = self._sessions[level] = self._open(level)
        return held


def open_session(content: bytes, source: str) -> Any:
    """Return a session on an ONNX file; ModelError names `source` and onnxruntime's reason."""
    options = onnxruntime.SessionOptions()
    # A pose takes microseconds: the overhead of threads would exceed their gain.
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    options.log_severity_level = 4
    # An arena keeps the memory of the longest clip in each session and saves no time.
    options.enable_cpu_mem_arena = False
    try:
        return onnxruntime.InferenceSession(content, options, providers=["CPUExecutionProvider"])
    except Exception as fault:  # onnxruntime's exceptions share no base of their own
        raise ModelError(source, f"onnxruntime cannot load it: {first_line(fault)}") from fault


def first_line(fault: Exception) -> str:
    """Return the first line of an exception's message, or its class where it has none."""
    return next(iter(str(fault).strip().splitlines()), type(fault).__name__)
