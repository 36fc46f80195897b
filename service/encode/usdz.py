"""USDZ: a zip archive that stores its layers unpacked and aligned, so that they can be mapped.

Readers take the first member for the root layer. `archive` writes other zips as well, and where a
USDZ would have to end it goes on in the records of Zip64.
"""

import struct
import zlib
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from service.encode import usd
from service.encode.convention import Convention
from service.motion import files
from service.motion.answer import ClipAnswer

NAME = "clip.usdc"
ALIGNMENT = 64
PADDING = 0x1986
"""Identifier of the extra field that pxr's own writer pads with."""
MEMBERS, BYTES = 0xFFFE, 0xFFFFFFFE
"""How many members an archive has at most, and how many bytes; USDZ knows no larger zip. One more
stands for what Zip64 says elsewhere."""

# 1980-01-01 00:00, the first moment a zip archive can name: the bytes hang on the content alone.
TIME, DATE = 0, 0x21
LOCAL = struct.Struct("<4s5H3L2H")
CENTRAL = struct.Struct("<4s6H3L5H2L")
END = struct.Struct("<4s4H2LH")
END_64, LOCATOR = struct.Struct("<4sQ2H2L4Q"), struct.Struct("<4sLQL")
VERSION, VERSION_64 = 10, 45


@dataclass(frozen=True)
class Member:
    """One file of an archive: its name there, its size and checksum, and its bytes in pieces."""

    name: str
    size: int
    crc: int
    chunks: Iterable[bytes]


def usdz(answers: Sequence[ClipAnswer], convention: Convention) -> list[bytes]:
    """USDZ of one binary layer each."""
    return list(map(package, usd.usdc(answers, convention)))


def package(data: bytes) -> bytes:
    """Archive of one file."""
    return b"".join(archive([whole(NAME, data)]))


def whole(name: str, data: bytes) -> Member:
    """Member whose bytes are at hand."""
    return Member(name, len(data), zlib.crc32(data), (data,))


def lying(name: str, path: Path) -> Member:
    """Member that lies in a file; it is read twice, and never held whole."""
    crc = 0
    for chunk in files.pieces(path):
        crc = zlib.crc32(chunk, crc)
    return Member(name, path.stat().st_size, crc, files.pieces(path))


def archive(members: Iterable[Member]) -> Iterator[bytes]:
    """Archive of stored members whose data start at multiples of 64 bytes, as they come.

    Raises ValueError for a name that is not ASCII: readers differ on what it says.
    """
    index, at = [], 0
    for member in members:
        # No flags, method 0 (stored).
        name = member.name.encode("ascii")
        common = (0, 0, TIME, DATE, member.crc, member.size, member.size, len(name))
        padding = _padding(at + LOCAL.size + len(name))
        local = LOCAL.pack(b"PK\3\4", VERSION, *common, len(padding)) + name + padding
        index.append(_central(common, at, name))
        yield local
        yield from member.chunks
        at += len(local) + member.size
    central = b"".join(index)
    yield central
    yield _end(len(index), len(central), at)


def _padding(before: int) -> bytes:
    """Extra field, of four bytes or more, that ends at a multiple of the alignment."""
    length = -(before + 4) % ALIGNMENT
    return struct.pack("<2H", PADDING, length) + bytes(length)


def _central(common: tuple[int, ...], at: int, name: bytes) -> bytes:
    """Entry of the index for a member at a place."""
    version, extra = VERSION, b""
    if at > BYTES:
        version, extra = VERSION_64, struct.pack("<2HQ", 1, 8, at)
    fields = (version, version, *common, len(extra), 0, 0, 0, 0, min(at, BYTES + 1))
    return CENTRAL.pack(b"PK\1\2", *fields) + name + extra


def _end(count: int, size: int, at: int) -> bytes:
    """End of an archive whose index has so many entries and bytes, and its place."""
    shown = min(count, MEMBERS + 1), min(size, BYTES + 1), min(at, BYTES + 1)
    end = END.pack(b"PK\5\6", 0, 0, shown[0], *shown, 0)
    if count <= MEMBERS and max(size, at) <= BYTES:
        return end
    versions = VERSION_64, VERSION_64
    whole = END_64.pack(b"PK\6\6", END_64.size - 12, *versions, 0, 0, count, count, size, at)
    return whole + LOCATOR.pack(b"PK\6\7", 0, at + size, 1) + end
