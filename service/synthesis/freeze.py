"""A model file whose level of detail is made a constant, so that no weights need be sliced.

A level that may be fed leaves every weight to be cut at every run, and none laid out beforehand:
half as slow again for a single pose. onnxruntime can neither make an input a constant nor be told
that it never changes, so its entry is taken out of the file's bytes. They are protocol buffers:
fields of a number, a kind and a content, of which only those on the way to the level are looked at.
"""

from collections.abc import Iterator

# Numbers of fields in onnx.proto.
GRAPH, INITIALIZER, INPUT = 7, 5, 11
TENSOR_TYPE, TENSOR_NAME, TENSOR_BYTES, VALUE_NAME = 2, 8, 9, 1
INT64 = 7
VARINT, LENGTH, FIXED = 0, 2, {1: 8, 5: 4}

Field = tuple[int, bytes, bytes]
"""A field's number, its bytes as they stand in the file, and what it holds."""


def at_level(model: bytes, level: int) -> bytes:
    """The same model, whose input `level` is a constant.

    Raises ValueError or LookupError where the bytes are no protocol buffer.
    """
    return b"".join(
        _field(GRAPH, _graph(content, level)) if number == GRAPH else whole
        for number, whole, content in _fields(model)
    )


def _graph(content: bytes, level: int) -> bytes:
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
    name = {INITIALIZER: TENSOR_NAME, INPUT: VALUE_NAME}.get(number)
    return name is not None and (name, b"level") in ((n, own) for n, _, own in _fields(content))


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
