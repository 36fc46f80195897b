"""Parts of an ONNX file as files of their own: one level of detail, or some outputs alone.

A level that is an input makes onnxruntime slice every weight at every run and prevents it from
packing them in advance: a single pose takes 1.5 times as long. onnxruntime cannot turn an input
into a constant, so the file's bytes are changed. It also computes nodes that a requested output
does not need: a duration by the whole graph takes four times as long.

Input files have passed `onnx_check`, which includes all fields that are read here.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from posefield.model_file import protobuf_wire
from posefield.model_file.protobuf_wire import Field

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


def select_outputs(model: bytes, *outputs: str) -> bytes:
    """Return the model with these outputs, and the nodes, weights and inputs that they need.

    outputs: names of float32 values of the graph. Raises ValueError for bytes that are not an ONNX
    file.
    """
    names = {output.encode() for output in outputs}
    return _replace_graph(model, lambda graph: _prune_graph(graph, names))


def initializers(model: bytes) -> dict[str, Array]:
    """Return the constants of the graph by name; ValueError for bytes that are not an ONNX file."""
    return dict(
        _read_tensor(field.content) for field in protobuf_wire.at(model, GRAPH, INITIALIZER)
    )


def _replace_graph(model: bytes, change: Callable[[bytes], bytes]) -> bytes:
    return b"".join(
        protobuf_wire.encode_bytes(GRAPH, change(field.content))
        if field.number == GRAPH
        else field.encoded
        for field in protobuf_wire.fields(model)
    )


def _read_tensor(content: bytes) -> tuple[str, Array]:
    """Return the name and the values of a constant."""
    fields = list(protobuf_wire.fields(content))
    held = {field.number: field for field in fields}
    axes = [field.value for field in fields if field.number == TENSOR_AXES]
    if not {TENSOR_TYPE, TENSOR_NAME} <= held.keys() or held[TENSOR_TYPE].value not in DTYPES:
        raise ValueError("it has a constant without name, or neither of float32 nor int64")
    # An empty array has no bytes in the file.
    numbers = held[TENSOR_BYTES].content if TENSOR_BYTES in held else b""
    array = np.frombuffer(numbers, DTYPES[held[TENSOR_TYPE].value])
    return held[TENSOR_NAME].content.decode(), array.reshape(axes)


def _prune_graph(graph: bytes, outputs: set[bytes]) -> bytes:
    fields = list(protobuf_wire.fields(graph))
    needed = set(outputs)
    # Nodes are in topological order: each stands before those that read its outputs.
    for field in reversed(fields):
        if field.number == NODE and needed & _field_names(field.content, NODE_OUTPUT):
            needed |= _field_names(field.content, NODE_INPUT)
    kept = b"".join(field.encoded for field in fields if _is_needed(field, needed))
    there = {
        name for f in fields if f.number == OUTPUT for name in _field_names(f.content, VALUE_NAME)
    }
    added = (
        protobuf_wire.encode_bytes(OUTPUT, _float_output(name)) for name in sorted(outputs - there)
    )
    return kept + b"".join(added)


def _is_needed(field: Field, names: set[bytes]) -> bool:
    return field.number not in NAME_FIELDS or bool(
        names & _field_names(field.content, NAME_FIELDS[field.number])
    )


def _float_output(name: bytes) -> bytes:
    """Return the description of an output of float32 numbers of any shape."""
    kind = protobuf_wire.encode_bytes(TYPE_TENSOR, protobuf_wire.encode_varint(ELEMENT_TYPE, FLOAT))
    return protobuf_wire.encode_bytes(VALUE_NAME, name) + protobuf_wire.encode_bytes(
        VALUE_TYPE, kind
    )


def _field_names(content: bytes, key: int) -> set[bytes]:
    return {field.content for field in protobuf_wire.fields(content) if field.number == key}


def _freeze_level(graph: bytes, level: int) -> bytes:
    fixed = b"".join(
        (
            protobuf_wire.encode_varint(TENSOR_TYPE, INT64),
            protobuf_wire.encode_bytes(TENSOR_NAME, b"level"),
            protobuf_wire.encode_bytes(TENSOR_BYTES, level.to_bytes(8, "little")),
        )
    )
    kept = (field.encoded for field in protobuf_wire.fields(graph) if not _is_level(field))
    return b"".join(kept) + protobuf_wire.encode_bytes(INITIALIZER, fixed)


def _is_level(field: Field) -> bool:
    named = field.number in (INITIALIZER, INPUT)
    return named and b"level" in _field_names(field.content, NAME_FIELDS[field.number])
