"""Where files of an export go: a folder here, or an object store."""

import re
from collections.abc import Iterable
from typing import Protocol
from urllib.parse import unquote, urlsplit

from service.export.folder import Folder
from service.motion.errors import InvalidField

STATE = ".posefield"
"""Folder of what a target holds only until its export is done."""
ASIDE = f"{STATE}/writing"
URL = re.compile(r"[a-z][a-z0-9+.-]*://", re.IGNORECASE)


class Target(Protocol):
    """A place of files by path, with `/` between folders; a file is whole there or not at all.

    Every method raises FileError, naming the file, where the place does not do what it should.
    """

    def write(self, files: Iterable[tuple[str, bytes]]) -> None:
        """Put files, in place of those of their names; all are there when it returns."""

    def stream(self, path: str, pieces: Iterable[bytes]) -> int:
        """Put one file that comes in pieces; its size in bytes."""

    def create(self, path: str, content: bytes) -> bool:
        """Put a file where there is none; False, and nothing done, where there is one."""

    def read(self, path: str) -> bytes | None:
        """Content of a file; None where there is none."""

    def names(self, folder: str) -> set[str]:
        """Names of the files in a folder."""

    def holds(self, path: str, size: int) -> bool:
        """Whether a file that was written has stayed, of that size in bytes."""

    def empty(self, but: str) -> bool:
        """Whether nothing is here but one folder."""

    def prepare(self) -> None:
        """Make ready to write."""

    def drop(self, path: str) -> None:
        """Take away a file, if it is there."""

    def remove(self, folder: str) -> None:
        """Take away a folder and all that is in it."""


def open_target(place: str) -> Target:
    """Target of a path, of a file:/// URL or, through obstore, of an object store's URL.

    Raises InvalidField for what is none of these, FileError for a store that cannot be used.
    """
    if not place:
        raise InvalidField("output", "empty, expected a folder or an object store's URL")
    if not URL.match(place):
        return Folder(place.rstrip("/") or "/", ASIDE)
    url = urlsplit(place)
    if url.scheme == "file":
        if url.netloc not in ("", "localhost"):
            raise InvalidField("output", f"{place!r}, expected file:///FOLDER: no host's files")
        return open_target(unquote(url.path))
    # An extra: most exports go to a disk.
    from service.export.store import Store

    return Store(place)
