"""Binary USD layer split into values, tokens, and sections that refer to tokens by index.

Only the table of contents of the format is parsed, as by every reader.
"""

import struct
from dataclasses import dataclass

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
    found = CrateParts(data[: listed[0][1]], sections)
    return found if join_crate(bytearray(found.values), sections) == data else None


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
