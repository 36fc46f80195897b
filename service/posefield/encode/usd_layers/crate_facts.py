"""Facts of a binary USD layer, written behind the values that usd-core wrote.

Facts differ from clip to clip in how many there are and in their texts, so usd-core would lay out
each layer in another way and no template would fit. Therefore usd-core writes a mark in their
place. The offset beside the mark then leads to a dictionary behind all other values, as the format
allows (pxr/usd/sdf/crateFile.cpp, `_RecursiveWrite`), and the texts are appended to the tables of
tokens and strings. Equal numbers and texts of other parts of the layer are not shared.
"""

import struct
from collections.abc import Mapping
from ctypes import c_float
from dataclasses import dataclass
from typing import Any

from posefield.encode.usd_layers import custom_data
from posefield.encode.usd_layers.crate_sections import CrateParts, CrateSection
from posefield.encode.usd_layers.crate_values import (
    ALIGNMENT,
    ARRAY,
    COUNT,
    DOUBLE,
    FLOAT,
    INDEX,
    INLINED,
    JUMP,
    LONG_INTEGER,
    TYPES,
)
from posefield.encode.usd_layers.custom_data import FactList

MARK = 1.2345678901234567e-300
"""The number that usd-core writes in place of the facts; float32 does not hold it."""

NAME = struct.Struct("<Iq")
"""Index of a name, and an offset."""
TOKENS_HEAD = struct.Struct("<QQQ")
"""Number of tokens, bytes of their texts, and bytes of these when compressed."""
MARKED = JUMP.pack(JUMP.size + DOUBLE.size) + DOUBLE.pack(MARK)
"""The mark in a layer: the offset of its description, from here, and its value."""
TEXT, NUMBER = TYPES[str] | INLINED, TYPES[float] | INLINED
ELEMENTS = {str: (TYPES[str], "I"), int: (LONG_INTEGER, "q"), float: (TYPES[float], "d")}
"""Type of a list's elements, and their form in `struct`."""


@dataclass(frozen=True)
class FactPlace:
    """The place of the facts in a layer, and its tables of texts.

    jump: position of the offset that leads to the facts. tokens: their number. text_bytes: bytes of
    their texts. sequences, literals: the compressed texts, without and as their last run. strings:
    the table, an index of a token each.
    """

    jump: int
    tokens: int
    text_bytes: int
    sequences: bytes
    literals: bytes
    strings: bytes

    def add(self, values: bytearray, facts: Mapping[str, Any]) -> tuple[CrateSection, CrateSection]:
        """Append facts to values; return the sections of tokens and of strings.

        Raises ValueError for a text with the character NUL, which ends a token.
        """
        writer = _FactWriter(values, {}, len(self.strings) // INDEX.size)
        found = writer.describe(facts)
        JUMP.pack_into(values, self.jump, len(values) - self.jump)
        values += COUNT.pack(found)
        return self._tables(list(writer.texts))

    def _tables(self, texts: list[str]) -> tuple[CrateSection, CrateSection]:
        if any("\0" in text for text in texts):
            raise ValueError("a fact with the character NUL, expected text without it")
        more = "".join(f"{text}\0" for text in texts).encode()
        literals = self.literals + more
        packed = self.sequences + _literal_run(len(literals)) + literals
        head = self.tokens + len(texts), self.text_bytes + len(more), len(packed)
        indices = range(self.tokens, self.tokens + len(texts))
        strings = self.strings + struct.pack(f"<{len(texts)}I", *indices)
        return (
            CrateSection(b"TOKENS", TOKENS_HEAD.pack(*head) + packed),
            CrateSection(b"STRINGS", COUNT.pack(len(strings) // INDEX.size) + strings),
        )


def find_place(parts: CrateParts) -> FactPlace | None:
    """Return the place of the facts in a layer with a mark; None for another layout."""
    jump = parts.values.find(MARKED)
    if jump < 0 or [section.name for section in parts.sections[:2]] != [b"TOKENS", b"STRINGS"]:
        return None
    tokens, strings = (section.content for section in parts.sections[:2])
    count, text_bytes, size = TOKENS_HEAD.unpack_from(tokens)
    packed = tokens[TOKENS_HEAD.size :]
    # The first byte counts further parts of a text of gigabytes.
    if len(packed) != size or packed[0] != 0:
        return None
    start, length = _last_run(packed)
    literals = packed[len(packed) - length :]
    return FactPlace(jump, count, text_bytes, packed[:start], literals, strings[COUNT.size :])


@dataclass
class _FactWriter:
    """Writer of facts behind values.

    texts: index in the table of strings, of which the layer has `before`.
    """

    values: bytearray
    texts: dict[str, int]
    before: int

    def describe(self, fact: Any) -> int:
        """Return the description of a fact, whose value is written if it does not hold it."""
        kind = type(fact)
        if kind is float:
            return self._number(fact)
        if kind is str:
            return TEXT | self._string(fact)
        if kind is dict:
            return self._dictionary(fact)
        if kind is bool:
            return TYPES[bool] | INLINED | fact
        if kind is int and abs(fact) <= custom_data.LARGEST_INTEGER:
            return self._integer(fact)
        if kind is FactList:
            return self._list(fact)
        return self.describe(custom_data.plain_fact(fact))

    def _integer(self, fact: int) -> int:
        if -(1 << 31) <= fact < 1 << 31:
            return TYPES[int] | INLINED | fact & 0xFFFFFFFF
        return LONG_INTEGER | self._append(JUMP.pack(fact))

    def _number(self, fact: float) -> int:
        if c_float(fact).value == fact:
            return NUMBER | int.from_bytes(FLOAT.pack(fact), "little")
        return TYPES[float] | self._append(DOUBLE.pack(fact))

    def _list(self, fact: FactList) -> int:
        kind, form = ELEMENTS[fact.kind]
        if not fact.items:
            return kind | ARRAY
        items = [self._string(each) for each in fact.items] if fact.kind is str else fact.items
        self.values += bytes(-len(self.values) % ALIGNMENT)
        found = self._append(COUNT.pack(len(items)) + struct.pack(f"<{len(items)}{form}", *items))
        return kind | ARRAY | found

    def _dictionary(self, facts: Mapping[str, Any]) -> int:
        """Write a dictionary: for each fact its name, an offset, its value and its description."""
        values = self.values
        names = sorted([name for name, fact in facts.items() if fact is not None])
        found = self._append(COUNT.pack(len(names)))
        for name in names:
            values += NAME.pack(self._string(name), 0)
            end = len(values)
            described = self.describe(facts[name])
            JUMP.pack_into(values, end - JUMP.size, len(values) - end + JUMP.size)
            values += COUNT.pack(described)
        return TYPES[dict] | found

    def _append(self, written: bytes) -> int:
        """Return the offset of bytes after they are written."""
        offset = len(self.values)
        self.values += written
        return offset

    def _string(self, text: str) -> int:
        return self.texts.setdefault(text, self.before + len(self.texts))


# LZ4, by which tokens are compressed, alternates runs of literal bytes with copies of earlier ones
# (https://github.com/lz4/lz4/blob/dev/doc/lz4_Block_format.md). A run's length is in four bits,
# and if these are full, in further bytes, of which the last is below 255.
FULL = 15


def _last_run(packed: bytes) -> tuple[int, int]:
    """Return the start and the length of the last run of compressed bytes, after the first byte."""
    at = 1
    while True:
        start, head = at, packed[at]
        length, at = _run_length(packed, at + 1, head >> 4)
        at += length
        if at >= len(packed):
            return start, length
        _, at = _run_length(packed, at + 2, head & FULL)


def _run_length(packed: bytes, at: int, length: int) -> tuple[int, int]:
    """Return a length of which four bits are known, and the position after it."""
    while length >= FULL:
        length += packed[at]
        at += 1
        if packed[at - 1] < 255:
            break
    return length, at


def _literal_run(length: int) -> bytes:
    """Return the head of a last run of that length."""
    if length < FULL:
        return bytes([length << 4])
    full, rest = divmod(length - FULL, 255)
    return bytes([FULL << 4]) + b"\xff" * full + bytes([rest])
