"""USDZ: a zip archive that stores its layers unpacked and aligned, so that they can be mapped.

Readers take the first member for the root layer.
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
MEMBERS, BYTES = 0xFFFF, 0xFFFFFFFF
"""How many members an archive has at most, and how many bytes; USDZ knows no larger zip."""

# 1980-01-01 00:00, the first moment a zip archive can name: the bytes hang on the content alone.
TIME, DATE = 0, 0x21
LOCAL = struct.Struct("<4s5H3L2H")
CENTRAL = struct.Struct("<4s6H3L5H2L")
END = struct.Struct("<4s4H2LH")


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
    """Archive of stored members whose data start at multiples of 64 bytes, as they come."""
    index, at = [], 0
    for member in members:
        # Version 1.0, no flags, method 0 (stored).
        name = member.name.encode()
        common = (10, 0, 0, TIME, DATE, member.crc, member.size, member.size, len(name))
        padding = _padding(at + LOCAL.size + len(name))
        local = LOCAL.pack(b"PK\3\4", *common, len(padding)) + name + padding
        index.append(CENTRAL.pack(b"PK\1\2", 10, *common, 0, 0, 0, 0, 0, at) + name)
        yield local
        yield from member.chunks
        at += len(local) + member.size
    central = b"".join(index)
    yield central
    yield END.pack(b"PK\5\6", 0, 0, len(index), len(index), len(central), at, 0)


def _padding(before: int) -> bytes:
    """Extra field, of four bytes or more, that ends at a multiple of the alignment."""
    length = -(before + 4) % ALIGNMENT
    return struct.pack("<2H", PADDING, length) + bytes(length)
