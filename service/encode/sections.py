"""A binary layer in pieces: values first, then its words, then all that refers to them by number.

Of the format this takes what its table of contents says, which is also what every reader takes.
"""

import struct
from dataclasses import dataclass

TABLE = struct.Struct("<q")
"""Where in the head of a file the place of its table stands, and how a table counts."""
TABLE_AT = 16
ENTRY = struct.Struct("<16sqq")
WORDS = b"TOKENS"


@dataclass(frozen=True)
class Section:
    """One section by name, and its bytes."""

    name: bytes
    content: bytes


@dataclass(frozen=True)
class Pieces:
    """Head and values, without the place of the table, and the sections, the words first."""

    values: bytes
    sections: tuple[Section, ...]

    @property
    def words(self) -> bytes:
        """The section of words."""
        return self.sections[0].content

    def alike(self, other: "Pieces") -> bool:
        """Whether both say the same but for the spelling of their words."""
        return self.values == other.values and self.sections[1:] == other.sections[1:]


def pieces(data: bytes) -> Pieces | None:
    """Pieces of a binary layer; None where it is laid out in another way."""
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
    """Name, start and size of each section that the table of a binary layer lists."""
    (table,) = TABLE.unpack_from(data, TABLE_AT)
    (count,) = TABLE.unpack_from(data, table)
    return [ENTRY.unpack_from(data, table + TABLE.size + i * ENTRY.size) for i in range(count)]


def joined(values: bytes | bytearray, sections: tuple[Section, ...]) -> bytes:
    """The binary layer again."""
    made = bytearray(values)
    end = tail(made, sections)
    return bytes(made) + end


def tail(values: bytearray, sections: tuple[Section, ...]) -> bytes:
    """Sections and table that follow the values, in which the place of the table is set."""
    start, entries = len(values), []
    for section in sections:
        entries.append(ENTRY.pack(section.name, start, len(section.content)))
        start += len(section.content)
    TABLE.pack_into(values, TABLE_AT, start)
    contents = (section.content for section in sections)
    return b"".join((*contents, TABLE.pack(len(sections)), *entries))


def placed(values: bytearray, table: int) -> bytes:
    """Head and values with another place of the table."""
    TABLE.pack_into(values, TABLE_AT, table)
    return bytes(values)
