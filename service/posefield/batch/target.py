"""Targets of an export: a folder, or an object store."""

import hashlib
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Protocol
from urllib.parse import unquote, urlsplit

from posefield.batch.folder_target import FolderTarget
from posefield.common.errors import InvalidField

STATE_FOLDER = ".posefield"
"""Folder that a target contains only until its export is complete."""
TEMPORARY_FILE = f"{STATE_FOLDER}/writing"
URL = re.compile(r"[a-z][a-z0-9+.-]*://", re.IGNORECASE)


class ExportTarget(Protocol):
    """Files by path, with `/` between folders; each is complete or absent.

    Every method raises FileError, which names the file, if the folder or the store fails.
    """

    def write(self, files: Iterable[tuple[str, bytes]]) -> None:
        """Write files, replacing those of the same names; all are written when it returns."""

    def stream(self, path: str, pieces: Iterable[bytes]) -> None:
        """Write one file from an iterable of pieces."""

    def create(self, path: str, content: bytes) -> bool:
        """Write a file if none exists; return whether it was written."""

    def read(self, path: str) -> bytes | None:
        """Return the content of a file; None if it does not exist."""

    def pieces(self, path: str) -> Iterator[bytes]:
        """Yield the content of a file in pieces; none if it does not exist."""

    def names(self, folder: str) -> set[str]:
        """Return the names of the files in a folder."""

    def holds(self, path: str, size: int) -> bool:
        """Return whether a written file still exists, with that size in bytes."""

    def empty(self, but: str) -> bool:
        """Return whether the target contains nothing except, possibly, the folder `but`."""

    def prepare(self) -> None:
        """Create the folders that writing needs."""

    def drop(self, path: str) -> None:
        """Remove a file, if it exists."""

    def remove(self, folder: str) -> None:
        """Remove a folder and its content."""


@dataclass(frozen=True)
class WrittenFile:
    """A written file: its path in the target, its size in bytes and its SHA-256."""

    file: str
    bytes: int
    sha256: str


def put_file(target: ExportTarget, path: str, pieces: Iterable[bytes]) -> WrittenFile:
    """Write one file from an iterable of pieces; return its size and checksum. Raises FileError."""
    size, digest = 0, hashlib.sha256()

    def counted() -> Iterator[bytes]:
        nonlocal size
        for piece in pieces:
            size += len(piece)
            digest.update(piece)
            yield piece

    target.stream(path, counted())
    return WrittenFile(path, size, digest.hexdigest())


def is_intact(target: ExportTarget, written: WrittenFile, verify: bool) -> bool:
    """Return whether a file is unchanged, by its size or, with `verify`, its SHA-256."""
    if not verify:
        return target.holds(written.file, written.bytes)
    digest = hashlib.sha256()
    for piece in target.pieces(written.file):
        digest.update(piece)
    return digest.hexdigest() == written.sha256


def read_lines(target: ExportTarget, path: str) -> Iterator[bytes]:
    """Yield the lines of a file, without holding the whole file in memory."""
    rest = b""
    for piece in target.pieces(path):
        *whole, rest = (rest + piece).split(b"\n")
        yield from whole
    if rest:
        yield rest


def open_target(place: str) -> ExportTarget:
    """Return the target of a path, of a file:/// URL or, through obstore, of an object store's URL.

    Raises InvalidField for any other text, and FileError for a store that cannot be used.
    """
    if not place:
        raise InvalidField("output", "empty, expected a folder or an object store's URL")
    if not URL.match(place):
        return FolderTarget(place.rstrip("/") or "/", TEMPORARY_FILE)
    url = urlsplit(place)
    if url.scheme == "file":
        if url.netloc not in ("", "localhost"):
            raise InvalidField("output", f"{place!r}, expected file:///FOLDER without a host")
        return open_target(unquote(url.path))
    # Imported here because obstore is an optional extra.
    from posefield.batch.store_target import StoreTarget

    return StoreTarget(place)
