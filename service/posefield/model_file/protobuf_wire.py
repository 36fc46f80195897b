"""Wire format of protocol buffers: reading and writing the fields of a message.

Reference: https://protobuf.dev/programming-guides/encoding/. Groups, which proto2 deprecates, are
refused. docs/decisions/0022-model-file-checks.md states the reasons for not using a library.
"""

from collections.abc import Iterator
from typing import NamedTuple

VARINT, LENGTH = 0, 2
FIXED_SIZES = {1: 8, 5: 4}
"""Bytes of numbers of a fixed size, by wire type."""
MAX_VARINT_BYTES = 10
"""Bytes of the longest varint: 64 bits, seven in a byte."""


class Field(NamedTuple):
    """One field of a message.

    number: field number. kind: wire type. value: the number of a varint, else 0. content: the bytes
    of any other field. whole: the bytes of the field with key and length.
    """

    number: int
    kind: int
    value: int
    content: bytes
    encoded: bytes


def fields(message: bytes) -> Iterator[Field]:
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


def at(message: bytes, number: int, *inner: int) -> Iterator[Field]:
    """Yield the fields with a number, or at a path of numbers through nested messages."""
    for field in fields(message):
        if field.number == number:
            yield from at(field.content, *inner) if inner else (field,)


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
