"""ONNX files as protocol buffers: a check before onnxruntime reads them, and files of parts.

Only fields and operators that posefield's exporter writes are accepted, so that a file holds no
loop, sub-graph, function, custom operator or reference to another file.
tests/service/synthesis/test_onnx_check.py compares both lists with files that the exporter writes.

A level that is an input makes onnxruntime slice every weight at every run and prevents it from
packing them in advance: a single pose takes 1.5 times as long. onnxruntime cannot turn an input
into a constant, so the file's bytes are changed. It also computes nodes that a requested output
does not need: a duration by the whole graph takes four times as long. Files of which parts are
taken have passed `check`, which includes all fields that are read here.

Reference: https://protobuf.dev/programming-guides/encoding/. Groups, which proto2 deprecates, are
refused. docs/decisions/0022-model-file-checks.md states the reasons for not using a library.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

VARINT, LENGTH = 0, 2
FIXED_SIZES = {1: 8, 5: 4}
"""Bytes of numbers of a fixed size, by wire type."""
MAX_VARINT_BYTES = 10
"""Bytes of the longest varint: 64 bits, seven in a byte."""


class Field(NamedTuple):
    """One field of a message.

    number: field number. kind: wire type. value: the number of a varint, else 0. content: the bytes
    of any other field. encoded: the bytes of the field with key and length.
    """

    number: int
    kind: int
    value: int
    content: bytes
    encoded: bytes


def wire_fields(message: bytes) -> Iterator[Field]:
    """Yield the fields of a message; ValueError for malformed bytes."""
    at, end = 0, len(message)
    while at < end:
        start, (key, at) = at, _decode_varint(message, at)
        number, kind = key >> 3, key & 7
        if number == 0:
            raise ValueError(f"a field 0 at byte {start}, expected 1 or more")
        if kind == VARINT:
            value, at = _decode_varint(message, at)
            yield Field(number, kind, value, b"", message[start:at])
            continue
        if kind == LENGTH:
            size, at = _decode_varint(message, at)
        elif kind in FIXED_SIZES:
            size = FIXED_SIZES[kind]
        else:
            raise ValueError(f"field {number} has wire type {kind}, expected 0, 1, 2 or 5")
        if size > end - at:
            raise ValueError(f"field {number} takes {size} bytes, and {end - at} follow")
        at += size
        yield Field(number, kind, 0, message[at - size : at], message[start:at])


def fields_at(message: bytes, number: int, *inner: int) -> Iterator[Field]:
    """Yield the fields with a number, or at a path of numbers through nested messages."""
    for field in wire_fields(message):
        if field.number == number:
            yield from fields_at(field.content, *inner) if inner else (field,)


def encode_varint(number: int, value: int) -> bytes:
    """Return a varint field with a value of 0 or more."""
    return _encode_number(number << 3 | VARINT) + _encode_number(value)


def encode_bytes(number: int, content: bytes) -> bytes:
    """Return a field that contains bytes, a text or a message."""
    return _encode_number(number << 3 | LENGTH) + _encode_number(len(content)) + content


def _decode_varint(message: bytes, at: int) -> tuple[int, int]:
    """Return the varint at an offset, lowest seven bits first, and the offset after it."""
    # A fast path for one byte: most varints have one, and this is called very often.
    if at < len(message) and message[at] < 0x80:
        return message[at], at + 1
    value = 0
    for count, byte in enumerate(message[at : at + MAX_VARINT_BYTES]):
        value |= (byte & 0x7F) << 7 * count
        if byte < 0x80:
            return value, at + count + 1
    raise ValueError(f"a number at byte {at} does not end")


def _encode_number(value: int) -> bytes:
    groups = []
    while value > 0x7F:
        groups.append(value & 0x7F | 0x80)
        value >>= 7
    return bytes([*groups, value])


OPERATORS = frozenset(
    "Add Cast Clip Concat Cos Div Exp Expand Floor Gather Gemm Identity Log MatMul Max Min Mul Neg"
    " OneHot Pad ReduceSum Relu Reshape Shape Sin Slice Softmax Split Sqrt Squeeze Sub Transpose"
    " Unsqueeze".split()
)

MAX_CONSTANT = 1e9
"""Largest size of a float constant; those of trained models are below 1e5."""

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
    used = {field.content.decode() for field in fields_at(content, 7, 1, 4)}
    if unknown := used - OPERATORS:
        operator = min(unknown)[:40]
        raise ValueError(f"its graph has an operator {operator!r}, which posefield does not use")
    constants = initializers(content)
    for name, array in constants.items():
        if array.dtype == DTYPES[FLOAT] and not (np.abs(array) <= MAX_CONSTANT).all():
            raise ValueError(f"its {name} are not all numbers up to {MAX_CONSTANT:g} in size")
    shapes = {name: array.shape for name, array in constants.items()}
    values = frozenset(field.content.decode() for field in fields_at(content, 7, 1, 2))
    return CheckedGraph(_metadata(content), shapes, values)


def _metadata(content: bytes) -> dict[str, bytes]:
    entries = [
        {field.number: field.content for field in wire_fields(entry.content)}
        for entry in fields_at(content, 14)
    ]
    metadata = {entry.get(1, b"").decode(): entry.get(2, b"") for entry in entries}
    if len(metadata) < len(entries):
        raise ValueError("two of its metadata entries have one key")
    return metadata


def _check_fields(message: bytes, allowed: AllowedFields, path: str) -> None:
    for field in wire_fields(message):
        field_path = f"{path}{field.number}"
        inner = allowed.get(field.number)
        if inner is None:
            raise ValueError(
                f"it has a field {field_path} of onnx.proto, which posefield does not write"
            )
        if inner:
            _check_fields(field.content, inner, f"{field_path}.")


Array = npt.NDArray[Any]

# Numbers of fields in onnx.proto.
GRAPH, NODE, INITIALIZER, INPUT, OUTPUT = 7, 1, 5, 11, 12
NODE_INPUT, NODE_OUTPUT = 1, 2
TENSOR_AXES, TENSOR_TYPE, TENSOR_NAME, TENSOR_BYTES = 1, 2, 8, 9
VALUE_NAME, VALUE_TYPE, TYPE_TENSOR, ELEMENT_TYPE = 1, 2, 1, 1
NAME_FIELDS = {
    NODE: NODE_OUTPUT,
    INITIALIZER: TENSOR_NAME,
    INPUT: VALUE_NAME,
    OUTPUT: VALUE_NAME,
}
"""Fields of a graph that define names, and the field in each that holds them."""
FLOAT, INT64 = 1, 7
DTYPES: dict[int, np.dtype[Any]] = {FLOAT: np.dtype("<f4"), INT64: np.dtype("<i8")}


def fix_level(model: bytes, level: int) -> bytes:
    """Return the model with a constant in place of its input `level`; ValueError for bad bytes."""
    return _replace_graph(model, lambda graph: _freeze_level(graph, level))


def select_outputs(model: bytes, *outputs: str, inputs: Sequence[str] = ()) -> bytes:
    """Return the model with these outputs, and the nodes, weights and inputs that they need.

    outputs: names of float32 values of the graph. inputs: names of such values that are given
    instead of computed. Raises ValueError for bytes that are not an ONNX file.
    """
    output_names, input_names = ({name.encode() for name in names} for names in (outputs, inputs))
    return _replace_graph(model, lambda graph: _prune_graph(graph, output_names, input_names))


def initializers(model: bytes) -> dict[str, Array]:
    """Return the constants of the graph by name; ValueError for bytes that are not an ONNX file."""
    return dict(_read_tensor(field.content) for field in fields_at(model, GRAPH, INITIALIZER))


def _replace_graph(model: bytes, change: Callable[[bytes], bytes]) -> bytes:
    return b"".join(
        encode_bytes(GRAPH, change(field.content)) if field.number == GRAPH else field.encoded
        for field in wire_fields(model)
    )


def _read_tensor(content: bytes) -> tuple[str, Array]:
    """Return the name and the values of a constant."""
    fields = list(wire_fields(content))
    field_of = {field.number: field for field in fields}
    axes = [field.value for field in fields if field.number == TENSOR_AXES]
    if (
        not {TENSOR_TYPE, TENSOR_NAME} <= field_of.keys()
        or field_of[TENSOR_TYPE].value not in DTYPES
    ):
        raise ValueError("it has a constant without name, or neither of float32 nor int64")
    # An empty array has no bytes in the file.
    numbers = field_of[TENSOR_BYTES].content if TENSOR_BYTES in field_of else b""
    array = np.frombuffer(numbers, DTYPES[field_of[TENSOR_TYPE].value])
    return field_of[TENSOR_NAME].content.decode(), array.reshape(axes)


def _prune_graph(graph: bytes, outputs: set[bytes], inputs: set[bytes]) -> bytes:
    fields = [
        field
        for field in wire_fields(graph)
        if field.number != NODE or not inputs & _field_names(field.content, NODE_OUTPUT)
    ]
    needed = set(outputs)
    # Nodes are in topological order: each stands before those that read its outputs.
    for field in reversed(fields):
        if field.number == NODE and needed & _field_names(field.content, NODE_OUTPUT):
            needed |= _field_names(field.content, NODE_INPUT)
    content = b"".join(field.encoded for field in fields if _is_needed(field, needed))
    there = {
        name for f in fields if f.number == OUTPUT for name in _field_names(f.content, VALUE_NAME)
    }
    added = [(OUTPUT, outputs - there), (INPUT, inputs & needed)]
    return content + b"".join(
        encode_bytes(kind, _float_value(name)) for kind, names in added for name in sorted(names)
    )


def _is_needed(field: Field, names: set[bytes]) -> bool:
    return field.number not in NAME_FIELDS or bool(
        names & _field_names(field.content, NAME_FIELDS[field.number])
    )


def _float_value(name: bytes) -> bytes:
    """Return the description of an input or output of float32 numbers of any shape."""
    kind = encode_bytes(TYPE_TENSOR, encode_varint(ELEMENT_TYPE, FLOAT))
    return encode_bytes(VALUE_NAME, name) + encode_bytes(VALUE_TYPE, kind)


def _field_names(content: bytes, key: int) -> set[bytes]:
    return {field.content for field in wire_fields(content) if field.number == key}


def _freeze_level(graph: bytes, level: int) -> bytes:
    fixed = b"".join(
        (
            encode_varint(TENSOR_TYPE, INT64),
            encode_bytes(TENSOR_NAME, b"level"),
            encode_bytes(TENSOR_BYTES, level.to_bytes(8, "little")),
        )
    )
    content = (field.encoded for field in wire_fields(graph) if not _is_level(field))
    return b"".join(content) + encode_bytes(INITIALIZER, fixed)


def _is_level(field: Field) -> bool:
    is_named = field.number in (INITIALIZER, INPUT)
    return is_named and b"level" in _field_names(field.content, NAME_FIELDS[field.number])
