"""Many files in one, tar or zip, sent while the files are made; the same files, the same bytes."""

import tarfile
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from datetime import UTC, datetime

from service.encode import usdz

Members = Iterable[tuple[str, bytes]]
"""Names in the archive, with / between folders, and contents."""

# The first moment that zip can name. Zero would do for tar, but GNU tar warns of so old a file.
MOMENT = int(datetime(1980, 1, 1, tzinfo=UTC).timestamp())
END = bytes(2 * tarfile.BLOCKSIZE)


@dataclass(frozen=True)
class Pack:
    """How one kind of archive is named and made."""

    extension: str
    media_type: str
    write: Callable[[Members], Iterator[bytes]]


def tar(members: Members) -> Iterator[bytes]:
    """POSIX tar of any number of files, nobody's and without a date, piece by piece.

    Names too long for ustar have a pax record. Raises ValueError for one that is not ASCII.
    """
    for name, content in members:
        yield _header(name, len(content))
        yield content
        yield bytes(-len(content) % tarfile.BLOCKSIZE)
    yield END


def _header(name: str, size: int) -> bytes:
    member = tarfile.TarInfo(name.encode("ascii").decode())
    member.size, member.mtime = size, MOMENT
    return member.tobuf(tarfile.PAX_FORMAT)


def zip(members: Members) -> Iterator[bytes]:  # noqa: A001  # read as packs.zip
    """Zip of files below 4 GiB each and without a date, stored, piece by piece.

    Beyond 65,534 files or 4 GiB it is a Zip64. Raises ValueError for a name that is not ASCII.
    """
    return usdz.archive(usdz.whole(name, content) for name, content in members)


PACKS = {
    pack.extension: pack
    for pack in (
        Pack("zip", "application/zip", zip),
        Pack("tar", "application/x-tar", tar),
    )
}
