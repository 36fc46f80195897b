"""Binary USD layer split into values, tokens, and sections that refer to tokens by index.

Only the table of contents of the format is parsed, as by every reader.

A value is described by 64 bits: flags, its type, and in the last 48 its offset or the value itself
(pxr/usd/sdf/crateFile.h, `ValueRep`). A dictionary or a list of samples has an offset from where it
lies to the description of each value in it.

usd-core writes a layer with a sample for each attribute. The offset that leads from an attribute to
its times and samples then leads to others behind all other values, of any number, as the format
allows (pxr/usd/sdf/crateFile.cpp, `Write(TimeSamples)`). Equal samples are stored once, as usd-core
does; a loop's last sample is its first.
"""

import struct
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
TOKEN_SECTION = b"TOKENS"


@dataclass(frozen=True)
class CrateSection:
    """One section: name and bytes."""

    name: bytes
    content: bytes


@dataclass(frozen=True)
class CrateParts:
    """Head and values, and the sections, tokens first."""

    values: bytes
    sections: tuple[CrateSection, ...]


def split_crate(data: bytes) -> CrateParts | None:
    """Return the pieces of a binary layer; None for another layout."""
    try:
        listed = _table_of_contents(data)
    except struct.error:
        return None
    sections = tuple(
        CrateSection(name.rstrip(b"\0"), data[start : start + size]) for name, start, size in listed
    )
    if (
        not sections
        or sections[0].name != TOKEN_SECTION
        or listed[0][1] < TABLE_OFFSET_POSITION + TABLE_OFFSET.size
    ):
        return None
    crate = CrateParts(data[: listed[0][1]], sections)
    return crate if join_crate(bytearray(crate.values), sections) == data else None


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
    for section in sections:
        entries.append(ENTRY.pack(section.name, start, len(section.content)))
        start += len(section.content)
    TABLE_OFFSET.pack_into(values, TABLE_OFFSET_POSITION, start)
    contents = (section.content for section in sections)
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


def find_place(values: bytes, row: Singles) -> SamplesPlace | None:
    """Return the place of an attribute with one sample (1, ...); None for another layout."""
    array = values.find(COUNT.pack(row.shape[1]) + row.tobytes())
    if array < 0:
        return None
    # The descriptions: of the times, an offset to the next byte, a count of one, of the sample.
    listed = JUMP.pack(JUMP.size) + COUNT.pack(1) + array.to_bytes(OFFSET_BITS // 8, "little")
    after = values.find(listed)
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

    Rows are compared by their first numbers, then by sums of a few numbers, and in full only if
    some of these are equal.
    """
    flat = rows.reshape(len(rows), -1)
    if _all_distinct(flat[:, 0]):
        return None
    probes = np.add.reduce(flat[:, :PROBED_NUMBERS], axis=1)
    if _all_distinct(probes):
        return None
    first = dict[Any, int]()
    alike = [first.setdefault(probe, index) for index, probe in enumerate(probes.tolist())]
    if not np.array_equal(rows, rows[alike]):
        first = {}
        alike = [first.setdefault(row.tobytes(), index) for index, row in enumerate(rows)]
    return np.array(alike) if len(first) < len(rows) else None


def _all_distinct(numbers: Singles) -> bool:
    ordered = np.sort(numbers)
    return not np.count_nonzero(ordered[1:] == ordered[:-1])
