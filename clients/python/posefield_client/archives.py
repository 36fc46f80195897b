"""Archives of clips or performances: count of files received, and check for completeness."""

import tarfile
import zipfile
from typing import BinaryIO

import msgspec

from posefield_client.errors import IncompleteAnswer
from posefield_client.generated import ManifestEntry, PerformanceEntry

MANIFEST = "manifest.jsonl"
ZIP_HEAD, TAR_BLOCK = 30, 512
STREAMED = 0x8
"""Flag of a zip member with its size after the data; the service writes the size before."""

Entry = ManifestEntry | PerformanceEntry
"""Line of a manifest: of an archive of clips, or of one of performances."""


class Counter:
    """Counter of the files of an archive while it is received, by their headers."""

    def __init__(self, ending: str) -> None:
        self.files = 0
        self._size, self._look = {"zip": (ZIP_HEAD, _zip), "tar": (TAR_BLOCK, _tar)}[ending]
        self._head = bytearray()
        self._left = 0
        self._is_file = True
        self._ended = False

    def feed(self, chunk: bytes) -> None:
        """Count files in the next bytes."""
        rest = memoryview(chunk)
        while rest and not self._ended:
            rest = self._pass(rest) if self._left else self._take(rest)

    def _pass(self, rest: memoryview) -> memoryview:
        passed = min(self._left, len(rest))
        self._left -= passed
        self.files += self._is_file and not self._left
        return rest[passed:]

    def _take(self, rest: memoryview) -> memoryview:
        wanted = self._size - len(self._head)
        self._head += rest[:wanted]
        if len(self._head) == self._size:
            self._left, self._is_file = self._look(bytes(self._head))
            self._ended = not self._left and not self._is_file
            self._head.clear()
        return rest[wanted:]


def _zip(head: bytes) -> tuple[int, bool]:
    """Return the number of bytes after a header and True for a file; (0, False) at the end."""
    if head[:4] != b"PK\3\4" or head[6] & STREAMED:
        return 0, False
    ends = ((18, 22), (26, 28), (28, 30))
    return sum(int.from_bytes(head[start:end], "little") for start, end in ends), True


def _tar(head: bytes) -> tuple[int, bool]:
    size = int(head[124:136].strip(b"\0 ") or b"0", 8)
    return size + -size % TAR_BLOCK, head[156:157] == b"0"


def check(file: BinaryIO, ending: str, count: int, form: type[Entry]) -> tuple[Entry, ...]:
    """Return the manifest's entries; IncompleteAnswer if the archive does not match them.

    form: of the entries.
    """
    decoder = msgspec.json.Decoder(form)
    try:
        sizes, manifest = {"zip": _of_zip, "tar": _of_tar}[ending](file)
        entries = tuple(map(decoder.decode, manifest.splitlines()))
    except (zipfile.BadZipFile, tarfile.TarError, KeyError, msgspec.DecodeError, EOFError) as fault:
        raise IncompleteAnswer(f"the archive broke off: {fault}") from None
    said = {entry.file: entry.bytes for entry in entries}
    if list(sizes)[-1:] != [MANIFEST] or len(entries) != count or said != _clips(sizes):
        raise IncompleteAnswer(f"the archive holds {len(sizes)} files, expected {count + 1}")
    return entries


def _clips(sizes: dict[str, int]) -> dict[str, int]:
    return {name: size for name, size in sizes.items() if name != MANIFEST}


def _of_zip(file: BinaryIO) -> tuple[dict[str, int], bytes]:
    with zipfile.ZipFile(file) as archive:
        sizes = {info.filename: info.file_size for info in archive.infolist()}
        return sizes, archive.read(MANIFEST)


def _of_tar(file: BinaryIO) -> tuple[dict[str, int], bytes]:
    with tarfile.open(fileobj=file, mode="r:") as archive:
        sizes = {member.name: member.size for member in archive.getmembers()}
        manifest = archive.extractfile(MANIFEST)
        assert manifest is not None
        return sizes, manifest.read()
