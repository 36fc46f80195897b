"""Time of a level by groups of the graph's operators, by onnxruntime's own profiler.

Operators are grouped by the graph's outputs that depend on them, so that nothing here assumes how
the graph is written inside.
"""

import json
from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from typing import Any

import onnx
import onnxruntime

from posefield.model_file import onnx_file

Feed = dict[str, Any]
PRODUCTS = ("MatMul", "Gemm")
KERNEL = "_kernel_time"
RUNS = 200


@dataclass(frozen=True)
class Part:
    """Cost of a group of operators in a run: seconds; numbers that it outputs."""

    seconds: float
    numbers: int


def of(content: bytes, level: int, feed: Feed) -> dict[str, Part]:
    """Parts of a run of a model's level on one thread, by the name of their group."""
    model = onnx.load_from_string(onnx_file.fix_level(content, level))
    for node in model.graph.node:
        node.name = node.output[0]
    groups = _groups(model.graph)
    seconds, numbers = defaultdict(float), defaultdict(int)
    for name, events in _events(model.SerializeToString(), feed).items():
        group = groups.get(name, REST)
        seconds[group] += 1e-6 * median(event["dur"] for event in events)
        numbers[group] += int(events[0]["args"]["output_size"]) // 4
    return {group: Part(seconds[group], numbers[group]) for group in seconds}


def _events(content: bytes, feed: Feed) -> dict[str, list[Any]]:
    """The profiler's entries of all runs by the name of their node."""
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    options.log_severity_level = 4
    options.enable_profiling = True
    with TemporaryDirectory() as folder:
        options.profile_file_prefix = str(Path(folder) / "profile")
        providers = ["CPUExecutionProvider"]
        session = onnxruntime.InferenceSession(content, options, providers=providers)
        for _ in range(RUNS):
            session.run(None, feed)
        entries = json.loads(Path(session.end_profiling()).read_text())
    durations = defaultdict(list)
    for entry in entries:
        if entry["name"].endswith(KERNEL):
            durations[entry["name"].removesuffix(KERNEL)].append(entry)
    return durations


COVARIANCES, KRIGING, TIME = "covariances", "kriging products", "canonical time and travel"
BONES, SIGMA, TENSOR = "bone offsets", "sigma", "products of core, time basis and directions"
QUATERNIONS, REST = "quaternions, made and put in order", "everything else"


def _groups(graph: Any) -> dict[str, str]:
    """Return each node's group by its name: of the first output, in this order, that needs it."""
    made_by = {output: node for node in graph.node for output in node.output}
    rules: dict[str, Callable[[Any], str]] = {
        "duration": lambda node: KRIGING if _is_product(node) else COVARIANCES,
        "travel": lambda _: TIME,
        "bone_offsets": lambda _: BONES,
        "sigma": lambda _: SIGMA,
        "rotations": lambda node: TENSOR if _is_product(node) else QUATERNIONS,
        "root_position": lambda _: TENSOR,
    }
    groups: dict[str, str] = {}
    for output, rule in rules.items():
        for node in _behind(output, made_by):
            groups.setdefault(node.name, rule(node))
    return groups


def _is_product(node: Any) -> bool:
    return node.op_type in PRODUCTS


def _behind(output: str, made_by: dict[str, Any]) -> list[Any]:
    """Return the nodes that an output needs."""
    sources: dict[str, Any] = {}
    waiting = [output]
    while waiting:
        node = made_by.get(waiting.pop())
        if node is not None and node.name not in sources:
            sources[node.name] = node
            waiting += node.input
    return list(sources.values())
