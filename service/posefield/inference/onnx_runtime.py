"""Sessions of onnxruntime, each on one thread of the CPU, and on parts of a model's graph.

onnxruntime computes whatever a session holds, asked for or not, so that each set of values that
the program asks for has a session of its own, opened at first use. The sets are those of the
program's calls, never of a request.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import onnxruntime

from posefield.common.errors import ModelError
from posefield.common.units import Singles
from posefield.model_file import onnx_file


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


Feed = Mapping[str, Singles]
"""Inputs of a graph by name."""


class Graph(Protocol):
    """A model's graph, of which any values can be asked for."""

    def run(self, values: Sequence[str], feed: Feed, level: int) -> list[Any]:
        """Return float32 values of the graph, by name, at a level of detail.

        feed: inputs; those that the values do not depend on are ignored.
        """
        ...


@dataclass(frozen=True)
class _Part:
    """An onnxruntime session and the inputs that it has."""

    session: Any
    inputs: tuple[str, ...]


class GraphParts:
    """Sessions on parts of one file's graph.

    Two threads that need a part at the same time each open a session; one of them is kept.
    """

    def __init__(self, content: bytes, source: str) -> None:
        """Take a checked file; source: its name in errors."""
        self._content, self._source = content, source
        self._parts: dict[tuple[tuple[str, ...], int], _Part] = {}

    def run(self, values: Sequence[str], feed: Feed, level: int) -> list[Any]:
        """Return values as `Graph.run` does."""
        key = tuple(values), level
        part = self._parts.get(key)
        if part is None:
            part = self._parts[key] = self._open(*key)
        own = {name: feed[name] for name in part.inputs if name in feed}
        found: list[Any] = part.session.run(key[0], own)
        return found

    def _open(self, values: tuple[str, ...], level: int) -> _Part:
        content = onnx_file.select_outputs(onnx_file.fix_level(self._content, level), *values)
        session = open_session(content, self._source)
        # Inputs with a default are not among the others.
        ports = [*session.get_inputs(), *session.get_overridable_initializers()]
        return _Part(session, tuple(port.name for port in ports))
