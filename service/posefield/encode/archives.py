"""Archives, tar or zip, streamed while their files are computed; equal files give equal bytes."""

import tarfile
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from datetime import UTC, datetime

from posefield.encode.files import zip_archive
from posefield.encode.files.media_types import Format, by_extension

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
        yield _tar_header(name, len(content))
        yield content
        yield bytes(-len(content) % tarfile.BLOCKSIZE)
    yield END_BLOCKS


def _tar_header(name: str, size: int) -> bytes:
    member = tarfile.TarInfo(name.encode("ascii").decode())
    member.size, member.mtime = size, MODIFICATION_TIME
    return member.tobuf(tarfile.PAX_FORMAT)


def zip(members: Members) -> Iterator[bytes]:  # noqa: A001  # read as packs.zip
    """Return an iterator over the chunks of a zip of stored files, without dates.

    Each file is below 4 GiB. Beyond 65,534 files or 4 GiB the archive is a Zip64. Raises ValueError
    for a name that is not ASCII.
    """
    return zip_archive.zip_chunks(zip_archive.whole(name, content) for name, content in members)


ARCHIVE_WRITERS = by_extension(
    ArchiveWriter("zip", "application/zip", zip),
    ArchiveWriter("tar", "application/x-tar", tar),
)
