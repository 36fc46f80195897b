"""Source files that are read more than once and must not change in between."""

import hashlib
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import AnyStr, TypeVar

from posefield.common.errors import FileError

Item = TypeVar("Item")

MAX_LINE_LENGTH = 1 << 20
"""Longest line, characters: a file without line ends is not a table and might not fit into
memory.
"""


@dataclass(frozen=True)
class SourceFile:
    """A file at its first reading.

    path: its path. digest: SHA-256 of its bytes. stamp: size in bytes and modification time, ns.
    """

    path: Path
    digest: str
    stamp: tuple[int, int]

    def unchanged(self, read: Iterable[Item]) -> Iterator[Item]:
        """Yield the items read from the file; FileError before the first one after a change."""
        self._check_unchanged()
        for each in read:
            self._check_unchanged()
            yield each
        self._check_unchanged()

    def _check_unchanged(self) -> None:
        if _stamp(self.path) != self.stamp:
            raise FileError(self.path, "changed while it was used, expected what was first read")


def fingerprint(path: Path) -> SourceFile:
    """Return a file's path, digest and stamp; FileError if it cannot be read."""
    if path.exists() and not path.is_file():
        raise FileError(path, "not a file, expected one: it is read more than once")
    stamp = _stamp(path)
    try:
        with path.open("rb") as file:
            digest = hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as fault:
        raise FileError(path, f"cannot be read: {fault.strerror}") from fault
    return SourceFile(path, digest, stamp)


def read_lines(path: Path, readline: Callable[[int], AnyStr]) -> Iterator[AnyStr]:
    """Yield the lines of an open file; FileError for a line that is too long."""
    for number, line in enumerate(iter(partial(readline, MAX_LINE_LENGTH), readline(0)), start=1):
        if len(line) == MAX_LINE_LENGTH:
            found = f"a line of {MAX_LINE_LENGTH} characters or more"
            raise FileError(path, f"{found}, expected one row a line", number)
        yield line


def _stamp(path: Path) -> tuple[int, int]:
    try:
        found = path.stat()
    except OSError as fault:
        raise FileError(path, f"cannot be read: {fault.strerror}") from fault
    return found.st_size, found.st_mtime_ns
