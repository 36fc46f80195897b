"""Check of an ONNX file before onnxruntime reads it.

Only fields and operators that posefield's exporter writes are accepted, so that a file holds no
loop, sub-graph, function, custom operator or reference to another file.
tests/service/synthesis/test_onnx_check.py compares both lists with files that the exporter writes.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from posefield.model_file import protobuf_wire, subgraph

OPERATORS = frozenset(
    "Add Cast Clip Concat Cos Div Exp Expand Floor Gather Gemm Identity Log MatMul Max Min Mul Neg"
    " OneHot Pad ReduceSum Relu Reshape Shape Sin Slice Softmax Split Sqrt Squeeze Sub Transpose"
    " Unsqueeze".split()
)

AllowedFields = Mapping[int, Any]
"""Fields that a message may have, each with the fields of its nested message; empty for other
values.
"""

_DIMENSION: AllowedFields = {1: {}, 2: {}}
_TENSOR_TYPE: AllowedFields = {1: {}, 2: {1: _DIMENSION}}
_VALUE: AllowedFields = {1: {}, 2: {1: _TENSOR_TYPE}}
_ATTRIBUTE: AllowedFields = {1: {}, 3: {}, 8: {}, 20: {}}
"""Name, type, integer and list of integers; no tensor (5), no graph (6, 11)."""
_NODE: AllowedFields = {1: {}, 2: {}, 4: {}, 5: _ATTRIBUTE}
"""No domain (7)."""
_CONSTANT: AllowedFields = {1: {}, 2: {}, 8: {}, 9: {}}
"""No data in other files (13, 14)."""
_GRAPH: AllowedFields = {1: _NODE, 2: {}, 5: _CONSTANT, 11: _VALUE, 12: _VALUE}
MODEL: AllowedFields = {1: {}, 2: {}, 3: {}, 7: _GRAPH, 8: {1: {}, 2: {}}, 14: {1: {}, 2: {}}}
"""No functions (25)."""


@dataclass(frozen=True)
class CheckedGraph:
    """Parts of an ONNX file that has passed the check.

    metadata: texts by key. shapes: shapes of the constants by name. values: names of all values
    that nodes compute.
    """

    metadata: Mapping[str, bytes]
    shapes: Mapping[str, tuple[int, ...]]
    values: frozenset[str]


def check(content: bytes) -> CheckedGraph:
    """Return the parts of a file; ValueError names the first field or operator not on the lists."""
    _check_fields(content, MODEL, "")
    used = {field.content.decode() for field in protobuf_wire.at(content, 7, 1, 4)}
    if others := used - OPERATORS:
        operator = min(others)[:40]
        raise ValueError(f"its graph has an operator {operator!r}, which posefield does not use")
    shapes = {name: array.shape for name, array in subgraph.initializers(content).items()}
    values = frozenset(field.content.decode() for field in protobuf_wire.at(content, 7, 1, 2))
    return CheckedGraph(_metadata(content), shapes, values)


def _metadata(content: bytes) -> dict[str, bytes]:
    entries = [
        {field.number: field.content for field in protobuf_wire.fields(entry.content)}
        for entry in protobuf_wire.at(content, 14)
    ]
    found = {entry.get(1, b"").decode(): entry.get(2, b"") for entry in entries}
    if len(found) < len(entries):
        raise ValueError("two of its metadata entries have one key")
    return found


def _check_fields(message: bytes, allowed: AllowedFields, path: str) -> None:
    for field in protobuf_wire.fields(message):
        own = f"{path}{field.number}"
        inner = allowed.get(field.number)
        if inner is None:
            raise ValueError(f"it has a field {own} of onnx.proto, which posefield does not write")
        if inner:
            _check_fields(field.content, inner, f"{own}.")
