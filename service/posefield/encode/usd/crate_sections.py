"""Binary USD layer split into values, tokens, and sections that refer to tokens by index.

Only the table of contents of the format is parsed, as by every reader.
"""

import struct
from dataclasses import dataclass

TABLE = struct.Struct("<q")
"""Offset of the table of contents in the head, and number of entries in the table."""
TABLE_AT = 16
ENTRY = struct.Struct("<16sqq")
WORDS = b"TOKENS"


@dataclass(frozen=True)
class Section:
    """One section: name and bytes."""

    name: bytes
    content: bytes


@dataclass(frozen=True)
class Pieces:
    """Head and values, with the table's offset set to zero, and the sections, tokens first."""

    values: bytes
    sections: tuple[Section, ...]

    @property
    def words(self) -> bytes:
        """Return the section of tokens."""
        return self.sections[0].content

    def alike(self, other: "Pieces") -> bool:
        """Return whether both are equal except for the text of their tokens."""
        return self.values == other.values and self.sections[1:] == other.sections[1:]


def pieces(data: bytes) -> Pieces | None:
    """Return the pieces of a binary layer; None for another layout."""
    try:
        listed = _listed(data)
    except struct.error:
        return None
    sections = tuple(
        Section(name.rstrip(b"\0"), data[start : start + size]) for name, start, size in listed
    )
    if not sections or sections[0].name != WORDS or listed[0][1] < TABLE_AT + TABLE.size:
        return None
    found = Pieces(placed(bytearray(data[: listed[0][1]]), 0), sections)
    return found if joined(found.values, found.sections) == data else None


def _listed(data: bytes) -> list[tuple[bytes, int, int]]:
    """Return name, start and size of each section in the table of a binary layer."""
    (table,) = TABLE.unpack_from(data, TABLE_AT)
    (count,) = TABLE.unpack_from(data, table)
    return [ENTRY.unpack_from(data, table + TABLE.size + i * ENTRY.size) for i in range(count)]


def joined(values: bytes | bytearray, sections: tuple[Section, ...]) -> bytes:
    """Return the binary layer of head, values and sections."""
    made = bytearray(values)
    end = tail(made, sections)
    return bytes(made) + end


def tail(values: bytearray, sections: tuple[Section, ...]) -> bytes:
    """Return sections and table for the end of a layer; set the table's offset in its head."""
    start, entries = len(values), []
    for section in sections:
        entries.append(ENTRY.pack(section.name, start, len(section.content)))
        start += len(section.content)
    TABLE.pack_into(values, TABLE_AT, start)
    contents = (section.content for section in sections)
    return b"".join((*contents, TABLE.pack(len(sections)), *entries))


def placed(values: bytearray, table: int) -> bytes:
    """Return head and values with the given offset of the table."""
    TABLE.pack_into(values, TABLE_AT, table)
    return bytes(values)
