"""Binary USD layer split into values and sections, and the samples and facts that it is given.

Only the table of contents of the format is parsed, as by every reader.

A value is described by 64 bits: flags, its type, and in the last 48 its offset or the value itself
(pxr/usd/sdf/crateFile.h, `ValueRep`). A dictionary or a list of samples has an offset from where it
lies to the description of each value in it.

usd-core writes a layer with a sample for each attribute. The offset that leads from an attribute to
its times and samples then leads to others behind all other values, of any number, as the format
allows (pxr/usd/sdf/crateFile.cpp, `Write(TimeSamples)`). Equal samples are stored once, as usd-core
does; a loop's last sample is its first.

Facts differ from clip to clip in how many there are and in their texts, so usd-core would lay out
each layer in another way. Therefore usd-core writes a mark in their place. The offset beside the
mark then leads to a dictionary behind all other values, as the format allows
(pxr/usd/sdf/crateFile.cpp, `_RecursiveWrite`), and the texts are appended to the tables of tokens
and strings. Equal numbers and texts of other parts of the layer are not shared.
"""

import struct
from collections.abc import Mapping, Sequence
from ctypes import c_float
from dataclasses import dataclass
from typing import Any

import numpy as np

from posefield.common.units import Indices, Singles

COUNT, INDEX, JUMP, FLOAT, DOUBLE = (struct.Struct(form) for form in ("<Q", "<I", "<q", "<f", "<d"))
"""A count or a description, an index of a text, an offset from its own place, and numbers."""
ALIGNMENT = 8
"""Of the offsets of arrays, which readers use where they lie."""
OFFSET_BITS = 48
ARRAY, INLINED = 1 << 63, 1 << 62
"""Flags of an array, and of a value that its description holds."""
TYPES = {bool: 1 << 48, int: 3 << 48, float: 9 << 48, str: 10 << 48, dict: 31 << 48}
"""Types of values: truths, integers of 32 bits, float64, texts, dictionaries."""
LONG_INTEGER = 5 << 48
"""Type of integers of 64 bits."""


TABLE_OFFSET = struct.Struct("<q")
"""Offset of the table of contents in the head, and number of entries in the table."""
TABLE_OFFSET_POSITION = 16
ENTRY = struct.Struct("<16sqq")
TOKEN_SECTION, STRING_SECTION = b"TOKENS", b"STRINGS"


CrateSection = tuple[bytes, bytes]
"""Name and content of a section."""


def split_crate(data: bytes) -> tuple[bytes, tuple[CrateSection, ...]] | None:
    """Return head and values of a binary layer, and its sections; None for another layout."""
    try:
        entries = _table_of_contents(data)
    except struct.error:
        return None
    sections = tuple(
        (name.rstrip(b"\0"), data[start : start + size]) for name, start, size in entries
    )
    if (
        not sections
        or sections[0][0] != TOKEN_SECTION
        or entries[0][1] < TABLE_OFFSET_POSITION + TABLE_OFFSET.size
    ):
        return None
    values = data[: entries[0][1]]
    return (values, sections) if join_crate(bytearray(values), sections) == data else None


def _table_of_contents(data: bytes) -> list[tuple[bytes, int, int]]:
    """Return name, start and size of each section in the table of a binary layer."""
    (table,) = TABLE_OFFSET.unpack_from(data, TABLE_OFFSET_POSITION)
    (count,) = TABLE_OFFSET.unpack_from(data, table)
    return [
        ENTRY.unpack_from(data, table + TABLE_OFFSET.size + i * ENTRY.size) for i in range(count)
    ]


def join_crate(values: bytearray, sections: tuple[CrateSection, ...]) -> bytes:
    """Return the binary layer of head, values and sections; set the table's offset in the head."""
    start, entries = len(values), []
    for name, content in sections:
        entries.append(ENTRY.pack(name, start, len(content)))
        start += len(content)
    TABLE_OFFSET.pack_into(values, TABLE_OFFSET_POSITION, start)
    contents = (content for _, content in sections)
    return b"".join((values, *contents, TABLE_OFFSET.pack(len(sections)), *entries))


ONE_TIME = COUNT.pack(1) + bytes(8)
"""Times of a single sample at time code 0."""
PROBED_NUMBERS = 8
"""Count of leading numbers of a sample whose sum is compared before whole samples are."""


@dataclass(frozen=True)
class SamplesPlace:
    """The place of an attribute's time samples in a layer.

    jump: position of the offset that leads to them. times, sample: descriptions of a list of times
    and of a sample, without their offsets.
    """

    jump: int
    times: int
    sample: int

    def add(self, values: bytearray, times: int, rows: Singles) -> None:
        """Append samples (F, ...) to values; times: offset of their times."""
        samples = _append_samples(values, rows)
        start = len(values)
        JUMP.pack_into(values, self.jump, start - self.jump)
        values += COUNT.pack(self.times | times) + JUMP.pack(JUMP.size) + COUNT.pack(len(rows))
        values += (samples.astype(np.uint64) | np.uint64(self.sample)).tobytes()


def add_times(values: bytearray, frames: int) -> int:
    """Append the time codes 0 to frames - 1 to values; return their offset."""
    offset = len(values)
    values += COUNT.pack(frames) + np.arange(frames, dtype=np.float64).tobytes()
    return offset


def find_samples(values: bytes, row: Singles) -> SamplesPlace | None:
    """Return the place of an attribute with one sample (1, ...); None for another layout."""
    array = values.find(COUNT.pack(row.shape[1]) + row.tobytes())
    if array < 0:
        return None
    # The descriptions: of the times, an offset to the next byte, a count of one, of the sample.
    descriptions = JUMP.pack(JUMP.size) + COUNT.pack(1) + array.to_bytes(OFFSET_BITS // 8, "little")
    after = values.find(descriptions)
    if after < 0:
        return None
    (times,) = COUNT.unpack_from(values, after - COUNT.size)
    (sample,) = COUNT.unpack_from(values, after + JUMP.size + COUNT.size)
    # The first attribute of a layer has the times beside it, others refer to these.
    for between in (b"", ONE_TIME):
        jump = after - COUNT.size - len(between) - JUMP.size
        if values[jump : after - COUNT.size] == JUMP.pack(JUMP.size + len(between)) + between:
            return SamplesPlace(jump, _without_offset(times), _without_offset(sample))
    return None


def _without_offset(description: int) -> int:
    return description >> OFFSET_BITS << OFFSET_BITS


def _append_samples(values: bytearray, rows: Singles) -> Indices:
    """Append the distinct rows (F, N, ...) as arrays of N; return the offset of each row (F,)."""
    contents = np.ascontiguousarray(rows).view(np.uint8).reshape(len(rows), -1)
    repeats, which = repeated_rows(rows), np.arange(len(rows))
    if repeats is not None:
        distinct, which = np.unique(repeats, return_inverse=True)
        contents = contents[distinct]
    size = COUNT.size + contents.shape[1]
    block = np.empty((len(contents), size + -size % ALIGNMENT), np.uint8)
    block[:, : COUNT.size] = np.frombuffer(COUNT.pack(rows.shape[1]), np.uint8)
    block[:, COUNT.size : size] = contents
    block[:, size:] = 0
    values += bytes(-len(values) % ALIGNMENT)
    offset = len(values)
    values += block.data
    offsets: Indices = offset + which * block.shape[1]
    return offsets


def repeated_rows(rows: Singles) -> Indices | None:
    """Return for each row (F, ...) the index of the first equal row; None if all rows differ.

    Rows are compared by sums of a few numbers, and in full only where these are equal.
    """
    probes = np.add.reduce(rows.reshape(len(rows), -1)[:, :PROBED_NUMBERS], axis=1)
    order = np.argsort(probes)
    alike = np.flatnonzero(probes[order[1:]] == probes[order[:-1]])
    if not len(alike):
        return None
    compared = np.zeros(len(rows), bool)
    compared[order[alike]] = compared[order[alike + 1]] = True
    first_equal, first = np.arange(len(rows)), dict[bytes, int]()
    for index in np.flatnonzero(compared).tolist():
        first_equal[index] = first.setdefault(rows[index].tobytes(), index)
    return first_equal if len(first) < np.count_nonzero(compared) else None


LARGEST_INTEGER = 2**63 - 1
"""Largest integer that every reader of a layer supports."""


def plain_fact(fact: Any) -> Any:
    """Return a fact as what USD holds: a text, truth or number, a list of one kind, a dictionary.

    A list is its kind, str, int or float, and a tuple of its elements. A mixed list is a dictionary
    by index, and an integer that readers do not support a text. Raises TypeError for any other
    value.
    """
    match fact:
        case np.generic() | np.ndarray():
            return plain_fact(fact.tolist())
        case Mapping():
            return dict(fact)
        case str():
            return str(fact)
        case bool():
            return fact
        case float():
            return float(fact)
        case int():
            return int(fact) if _is_supported(fact) else str(int(fact))
        case Sequence():
            return _plain_list(fact)
    raise TypeError(f"a fact of type {type(fact).__name__}, expected text, a number or several")


def _plain_list(facts: Sequence[Any]) -> tuple[type, tuple[Any, ...]] | dict[str, Any]:
    if all(isinstance(fact, str) for fact in facts):
        return str, tuple(facts)
    if all(_is_supported(fact) for fact in facts):
        return int, tuple(facts)
    if all(isinstance(fact, float | int) for fact in facts):
        return float, tuple(facts)
    return {str(index): fact for index, fact in enumerate(facts)}


def _is_supported(fact: Any) -> bool:
    return isinstance(fact, int) and abs(fact) <= LARGEST_INTEGER


MARK = 1.2345678901234567e-300
"""The number that usd-core writes in place of the facts; float32 does not hold it."""

INLINE_FACT, FLOAT_FACT = struct.Struct("<IqQ"), struct.Struct("<IqdQ")
"""Index of a name, an offset to a description, and this; in between a number."""
TOKENS_HEAD = struct.Struct("<QQQ")
"""Number of tokens, bytes of their texts, and bytes of these when compressed."""
MARKED = JUMP.pack(JUMP.size + DOUBLE.size) + DOUBLE.pack(MARK)
"""The mark in a layer: the offset of its description, from here, and its value."""
TEXT, NUMBER = TYPES[str] | INLINED, TYPES[float] | INLINED
PLAIN = frozenset((str, float, bool, dict))
"""Types of facts that are written as they are."""
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

    def add(self, values: bytearray, facts: Mapping[str, Any]) -> tuple[CrateSection, ...]:
        """Append facts to values; return the sections of tokens and of strings.

        Raises ValueError for a text with the character NUL, which ends a token.
        """
        writer = _FactWriter(values, {}, len(self.strings) // INDEX.size)
        description = writer.dictionary(facts)
        JUMP.pack_into(values, self.jump, len(values) - self.jump)
        values += COUNT.pack(description)
        return self._tables(list(writer.texts))

    def _tables(self, texts: list[str]) -> tuple[CrateSection, ...]:
        if any("\0" in text for text in texts):
            raise ValueError("a fact with the character NUL, expected text without it")
        text_bytes = "".join(f"{text}\0" for text in texts).encode()
        literals = self.literals + text_bytes
        packed = self.sequences + _literal_run(len(literals)) + literals
        head = self.tokens + len(texts), self.text_bytes + len(text_bytes), len(packed)
        indices = range(self.tokens, self.tokens + len(texts))
        strings = self.strings + struct.pack(f"<{len(texts)}I", *indices)
        return (
            (TOKEN_SECTION, TOKENS_HEAD.pack(*head) + packed),
            (STRING_SECTION, COUNT.pack(len(strings) // INDEX.size) + strings),
        )


def find_facts(values: bytes, sections: Sequence[CrateSection]) -> FactPlace | None:
    """Return the place of the facts in a layer with a mark; None for another layout."""
    jump = values.find(MARKED)
    if jump < 0 or [name for name, _ in sections[:2]] != [TOKEN_SECTION, STRING_SECTION]:
        return None
    (_, tokens), (_, strings) = sections[:2]
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

    def dictionary(self, facts: Mapping[str, Any]) -> int:
        """Return the description of facts, which are written.

        For each there is its name, an offset, a value unless the description holds it, and this.
        """
        names = sorted([name for name, fact in facts.items() if fact is not None])
        description = self._append(COUNT.pack(len(names)))
        for name in names:
            fact, index = facts[name], self._string(name)
            if type(fact) not in PLAIN:
                fact = plain_fact(fact)
            if type(fact) is str:
                self.values += INLINE_FACT.pack(index, JUMP.size, TEXT | self._string(fact))
            elif type(fact) is float:
                self.values += _float_fact(index, fact, len(self.values))
            else:
                self._fact(index, fact)
        return TYPES[dict] | description

    def _fact(self, index: int, fact: Any) -> None:
        """Write a fact of any length, by the index of its name."""
        jump = self._append(INDEX.pack(index) + bytes(JUMP.size)) + INDEX.size
        described = self._describe(fact)
        JUMP.pack_into(self.values, jump, len(self.values) - jump)
        self.values += COUNT.pack(described)

    def _describe(self, fact: Any) -> int:
        if isinstance(fact, dict):
            return self.dictionary(fact)
        if isinstance(fact, tuple):
            return self._list(*fact)
        return TYPES[bool] | INLINED | fact if isinstance(fact, bool) else self._integer(fact)

    def _integer(self, fact: int) -> int:
        if -(1 << 31) <= fact < 1 << 31:
            return TYPES[int] | INLINED | fact & 0xFFFFFFFF
        return LONG_INTEGER | self._append(JUMP.pack(fact))

    def _list(self, element: type, elements: tuple[Any, ...]) -> int:
        kind, form = ELEMENTS[element]
        if not elements:
            return kind | ARRAY
        items = [self._string(text) for text in elements] if element is str else elements
        self.values += bytes(-len(self.values) % ALIGNMENT)
        offset = self._append(COUNT.pack(len(items)) + struct.pack(f"<{len(items)}{form}", *items))
        return kind | ARRAY | offset

    def _append(self, content: bytes) -> int:
        """Return the offset of bytes after they are written."""
        offset = len(self.values)
        self.values += content
        return offset

    def _string(self, text: str) -> int:
        return self.texts.setdefault(text, self.before + len(self.texts))


def _float_fact(index: int, fact: float, at: int) -> bytes:
    """Return a number of a dictionary, by the index of its name, at an offset."""
    if c_float(fact).value == fact:
        bits = int.from_bytes(FLOAT.pack(fact), "little")
        return INLINE_FACT.pack(index, JUMP.size, NUMBER | bits)
    value = at + INDEX.size + JUMP.size
    return FLOAT_FACT.pack(index, JUMP.size + DOUBLE.size, fact, TYPES[float] | value)


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
