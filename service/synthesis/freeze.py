"""A model file cut down to what is asked of it: one level of detail, or one output.

A level that may be fed leaves every weight to be cut at every run, and none laid out beforehand:
half as slow again for a single pose. onnxruntime can neither make an input a constant nor be told
that it never changes, so its entry is taken out of the file's bytes. They are protocol buffers:
fields of a number, a kind and a content, of which only those on the way to the level are looked at.

Nor does onnxruntime leave out what an output that is asked for alone has no need of: how long a
clip takes, asked of the whole graph, costs four times as much.
"""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]

# Numbers of fields in onnx.proto.
GRAPH, NODE, INITIALIZER, INPUT, OUTPUT = 7, 1, 5, 11, 12
NODE_INPUT, NODE_OUTPUT = 1, 2
TENSOR_AXES, TENSOR_TYPE, TENSOR_NAME, TENSOR_BYTES = 1, 2, 8, 9
VALUE_NAME, VALUE_TYPE, TYPE_TENSOR, ELEMENT_TYPE = 1, 2, 1, 1
MADE = {
    NODE: NODE_OUTPUT,
    INITIALIZER: TENSOR_NAME,
    INPUT: VALUE_NAME,
    OUTPUT: VALUE_NAME,
}
"""Fields of a graph that make names known, and the field in each that holds them."""
FLOAT, INT64 = 1, 7
KINDS: dict[int, np.dtype[Any]] = {FLOAT: np.dtype("<f4"), INT64: np.dtype("<i8")}
VARINT, LENGTH, FIXED = 0, 2, {1: 8, 5: 4}

Field = tuple[int, bytes, bytes]
"""A field's number, its bytes as they stand in the file, and what it holds."""


def at_level(model: bytes, level: int) -> bytes:
    """The same model, whose input `level` is a constant.

    Raises ValueError or LookupError where the bytes are no protocol buffer.
    """
    return _with_graph(model, lambda graph: _frozen(graph, level))


def for_outputs(model: bytes, *outputs: str) -> bytes:
    """The same model with only those outputs, and the nodes, weights and inputs that they need; an
    output may be any float32 value of the graph.

    Raises ValueError or LookupError where the bytes are no protocol buffer.
    """
    names = {output.encode() for output in outputs}
    return _with_graph(model, lambda graph: _leading_to(graph, names))


def makes(model: bytes, value: str) -> bool:
    """Whether some node of the graph makes a value of that name.

    Raises ValueError or LookupError where the bytes are no protocol buffer.
    """
    graphs = [content for number, _, content in _fields(model) if number == GRAPH]
    fields = [field for graph in graphs for field in _fields(graph)]
    nodes = (own for number, _, own in fields if number == NODE)
    return any(value.encode() in _named(node, NODE_OUTPUT) for node in nodes)


def weights(model: bytes) -> dict[str, Array]:
    """Constants of the graph by name.

    Raises ValueError or LookupError where the bytes are no protocol buffer.
    """
    graphs = [content for number, _, content in _fields(model) if number == GRAPH]
    fields = [field for graph in graphs for field in _fields(graph)]
    return dict(_tensor(own) for number, _, own in fields if number == INITIALIZER)


def _with_graph(model: bytes, change: Callable[[bytes], bytes]) -> bytes:
    return b"".join(
        _field(GRAPH, change(content)) if number == GRAPH else whole
        for number, whole, content in _fields(model)
    )


def _tensor(content: bytes) -> tuple[str, Array]:
    """Name and numbers of a constant."""
    fields = list(_fields(content))
    held = {number: own for number, _, own in fields}
    kinds = [_varint(whole, 1)[0] for number, whole, _ in fields if number == TENSOR_TYPE]
    # Axes come one by one, or in one piece.
    axes: list[int] = []
    for number, whole, own in fields:
        if number == TENSOR_AXES:
            axes += _numbers(own) if own else [_varint(whole, 1)[0]]
    numbers = np.frombuffer(held.get(TENSOR_BYTES, b""), KINDS[kinds[0]])
    return held[TENSOR_NAME].decode(), numbers.reshape(axes)


def _numbers(packed: bytes) -> Iterator[int]:
    at = 0
    while at < len(packed):
        value, at = _varint(packed, at)
        yield value


def _leading_to(content: bytes, outputs: set[bytes]) -> bytes:
    fields = list(_fields(content))
    needed = set(outputs)
    # A node stands before those that need it.
    for number, _, own in reversed(fields):
        if number == NODE and needed & _named(own, NODE_OUTPUT):
            needed |= _named(own, NODE_INPUT)
    kept = b"".join(
        whole
        for number, whole, own in fields
        if number not in MADE or needed & _named(own, MADE[number])
    )
    there = {name for number, _, own in fields if number == OUTPUT for name in _named(own, 1)}
    return kept + b"".join(_field(OUTPUT, _floats(name)) for name in sorted(outputs - there))


def _floats(name: bytes) -> bytes:
    """Description of an output of float32 numbers, whatever its shape."""
    kind = _field(TYPE_TENSOR, bytes([ELEMENT_TYPE << 3 | VARINT, FLOAT]))
    return _field(VALUE_NAME, name) + _field(VALUE_TYPE, kind)


def _named(content: bytes, key: int) -> set[bytes]:
    return {own for number, _, own in _fields(content) if number == key}


def _frozen(content: bytes, level: int) -> bytes:
    fixed = b"".join(
        (
            bytes([TENSOR_TYPE << 3 | VARINT, INT64]),
            _field(TENSOR_NAME, b"level"),
            _field(TENSOR_BYTES, level.to_bytes(8, "little")),
        )
    )
    kept = (whole for number, whole, own in _fields(content) if not _is_level(number, own))
    return b"".join(kept) + _field(INITIALIZER, fixed)


def _is_level(number: int, content: bytes) -> bool:
    return number in (INITIALIZER, INPUT) and b"level" in _named(content, MADE[number])


def _fields(content: bytes) -> Iterator[Field]:
    at = 0
    while at < len(content):
        start, (key, at) = at, _varint(content, at)
        if key & 7 == LENGTH:
            size, at = _varint(content, at)
            at += size
            yield key >> 3, content[start:at], content[at - size : at]
            continue
        at = _varint(content, at)[1] if key & 7 == VARINT else at + FIXED[key & 7]
        yield key >> 3, content[start:at], b""
    if at != len(content):
        raise ValueError("a field is longer than what holds it")


def _varint(content: bytes, at: int) -> tuple[int, int]:
    """A whole number of seven bits a byte, the lowest first, and where the next thing stands."""
    value = shift = 0
    while True:
        byte = content[at]
        value |= (byte & 0x7F) << shift
        at, shift = at + 1, shift + 7
        if byte < 0x80:
            return value, at


def _field(number: int, content: bytes) -> bytes:
    return _packed(number << 3 | LENGTH) + _packed(len(content)) + content


def _packed(value: int) -> bytes:
    groups = []
    while value > 0x7F:
        groups.append(value & 0x7F | 0x80)
        value >>= 7
    return bytes([*groups, value])
