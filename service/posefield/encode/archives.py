"""Names of formats, and archives, tar or zip, which are streamed while their files are computed.

Equal files give equal bytes.

The members of zip archives are stored at multiples of 64 bytes, as USDZ requires, whose readers
take the first member as the root layer. An archive larger than USDZ allows continues as a Zip64.
"""

import struct
import tarfile
import zlib
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TypeVar

from posefield.common import atomic_files

JSON = "application/json"
ARROW = "application/vnd.apache.arrow.stream"
MSGPACK = "application/vnd.msgpack"
# No type is registered for archives of arrays; some browsers would unpack application/zip.
NPZ = "application/x-npz"


@dataclass(frozen=True)
class Format:
    """Name and media type of a format; the name is the extension of its files."""

    extension: str
    media_type: str


F = TypeVar("F", bound=Format)


def by_extension(*formats: F) -> dict[str, F]:
    """Return formats by their extensions, in the given order."""
    return {kind.extension: kind for kind in formats}


ALIGNMENT = 64
PADDING_ID = 0x1986
"""Identifier of the extra field that pxr's own writer pads with."""
MEMBERS, BYTES = 0xFFFE, 0xFFFFFFFE
"""Largest number of members and of bytes of an archive without Zip64, which USDZ does not support.

The next larger value refers to a record of Zip64.
"""

# 1980-01-01 00:00, the earliest time of the format, so that the bytes depend on the content alone.
TIME, DATE = 0, 0x21
LOCAL_HEADER = struct.Struct("<4s5H3L2H")
CENTRAL_HEADER = struct.Struct("<4s6H3L5H2L")
END_RECORD = struct.Struct("<4s4H2LH")
END_64, LOCATOR = struct.Struct("<4sQ2H2L4Q"), struct.Struct("<4sLQL")
VERSION, VERSION_64 = 10, 45


@dataclass(frozen=True)
class ZipMember:
    """One file of an archive: its name there, its size and checksum, and its bytes in chunks."""

    name: str
    size: int
    crc: int
    chunks: Iterable[bytes]


def whole(name: str, data: bytes) -> ZipMember:
    """Return a member of bytes in memory."""
    return ZipMember(name, len(data), zlib.crc32(data), (data,))


def member_of_file(name: str, path: Path) -> ZipMember:
    """Return a member of a file on disk; it is read twice, and never held in memory as a whole."""
    crc = 0
    for chunk in atomic_files.read_chunks(path):
        crc = zlib.crc32(chunk, crc)
    return ZipMember(name, path.stat().st_size, crc, atomic_files.read_chunks(path))


def zip_chunks(members: Iterable[ZipMember]) -> Iterator[bytes]:
    """Yield the chunks of an archive of stored members at multiples of 64 bytes.

    Raises ValueError for a name that is not ASCII: readers disagree on its encoding.
    """
    index, at = [], 0
    for member in members:
        # No flags, method 0 (stored).
        name = member.name.encode("ascii")
        common = (0, 0, TIME, DATE, member.crc, member.size, member.size, len(name))
        # An extra field, of four bytes or more, that ends at a multiple of the alignment.
        length = -(at + LOCAL_HEADER.size + len(name) + 4) % ALIGNMENT
        padding = struct.pack("<2H", PADDING_ID, length) + bytes(length)
        local = LOCAL_HEADER.pack(b"PK\3\4", VERSION, *common, len(padding)) + name + padding
        index.append(_central_entry(common, at, name))
        yield local
        yield from member.chunks
        at += len(local) + member.size
    central = b"".join(index)
    yield central
    yield _end_of_directory(len(index), len(central), at)


def _central_entry(common: tuple[int, ...], at: int, name: bytes) -> bytes:
    """Return the central directory entry of a member at an offset."""
    version, extra = VERSION, b""
    if at > BYTES:
        version, extra = VERSION_64, struct.pack("<2HQ", 1, 8, at)
    fields = (version, version, *common, len(extra), 0, 0, 0, 0, min(at, BYTES + 1))
    return CENTRAL_HEADER.pack(b"PK\1\2", *fields) + name + extra


def _end_of_directory(count: int, size: int, at: int) -> bytes:
    """Return the end of central directory, with its count of entries, size and offset."""
    limited = min(count, MEMBERS + 1), min(size, BYTES + 1), min(at, BYTES + 1)
    end = END_RECORD.pack(b"PK\5\6", 0, 0, limited[0], *limited, 0)
    if count <= MEMBERS and max(size, at) <= BYTES:
        return end
    versions = VERSION_64, VERSION_64
    end_64 = END_64.pack(b"PK\6\6", END_64.size - 12, *versions, 0, 0, count, count, size, at)
    return end_64 + LOCATOR.pack(b"PK\6\7", 0, at + size, 1) + end


Members = Iterable[tuple[str, bytes]]
"""Names in the archive, with / between folders, and contents."""

# The earliest time of the zip format. GNU tar would warn of files from time zero.
MODIFICATION_TIME = int(datetime(1980, 1, 1, tzinfo=UTC).timestamp())
END_BLOCKS = bytes(2 * tarfile.BLOCKSIZE)


@dataclass(frozen=True)
class ArchiveWriter(Format):
    """Writer of one kind of archive."""

    write: Callable[[Members], Iterator[bytes]]


def tar(members: Members) -> Iterator[bytes]:
    """Yield the chunks of a POSIX tar, without owners and dates.

    Names too long for ustar have a pax record. Raises ValueError for a name that is not ASCII.
    """
    for name, content in members:
        member = tarfile.TarInfo(name.encode("ascii").decode())
        member.size, member.mtime = len(content), MODIFICATION_TIME
        yield member.tobuf(tarfile.PAX_FORMAT)
        yield content
        yield bytes(-len(content) % tarfile.BLOCKSIZE)
    yield END_BLOCKS


def zip(members: Members) -> Iterator[bytes]:  # noqa: A001  # read as packs.zip
    """Return an iterator over the chunks of a zip of stored files, without dates.

    Each file is below 4 GiB. Beyond 65,534 files or 4 GiB the archive is a Zip64. Raises ValueError
    for a name that is not ASCII.
    """
    return zip_chunks(whole(name, content) for name, content in members)


ARCHIVE_WRITERS = by_extension(
    ArchiveWriter("zip", "application/zip", zip),
    ArchiveWriter("tar", "application/x-tar", tar),
)
