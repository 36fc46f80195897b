"""Targets of an export: a folder whose files are complete or absent, or an object store.

A file in a folder is written under a temporary name that is unique to the writer, and renamed: an
aborted write leaves only such a name, and two writers of one file do not conflict.
"""

import contextlib
import errno
import hashlib
import os
import re
import shutil
import time
import uuid
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol
from urllib.parse import unquote, urlsplit

from posefield.common import atomic_files
from posefield.common.errors import FileError, InvalidField

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


def is_intact(target: ExportTarget, file: WrittenFile, verify: bool) -> bool:
    """Return whether a file is unchanged, by its size or, with `verify`, its SHA-256."""
    if not verify:
        return target.holds(file.file, file.bytes)
    digest = hashlib.sha256()
    for piece in target.pieces(file.file):
        digest.update(piece)
    return digest.hexdigest() == file.sha256


def read_lines(target: ExportTarget, path: str) -> Iterator[bytes]:
    """Yield the lines of a file, without holding the whole file in memory."""
    rest = b""
    for piece in target.pieces(path):
        *lines, rest = (rest + piece).split(b"\n")
        yield from lines
    if rest:
        yield rest


def open_target(location: str) -> ExportTarget:
    """Return the target of a path, of a file:/// URL or, through obstore, of an object store's URL.

    Raises InvalidField for any other text, and FileError for a store that cannot be used.
    """
    if not location:
        raise InvalidField("output", "empty, expected a folder or an object store's URL")
    if not URL.match(location):
        return FolderTarget(location.rstrip("/") or "/", TEMPORARY_FILE)
    url = urlsplit(location)
    if url.scheme == "file":
        if url.netloc not in ("", "localhost"):
            raise InvalidField("output", f"{location!r}, expected file:///FOLDER without a host")
        return open_target(unquote(url.path))
    # Imported here because obstore is an optional extra.
    from posefield.batch.store_target import StoreTarget

    return StoreTarget(location)


TRIES, PAUSE = 40, 0.05
"""Attempts to remove a folder that another process may still be writing to, and the pause between
them, s.
"""

NO_HARD_LINK_ERRORS = (errno.EPERM, errno.ENOTSUP, errno.EOPNOTSUPP, errno.ENOSYS)
"""Errors of file systems without hard links: exFAT, and some network file systems."""


class FolderTarget:
    """Files under a root folder.

    Paths are strings: creating a Path costs a tenth of a small write.
    """

    def __init__(self, root: str, temporary: str) -> None:
        self.root = root
        self._temporary_path = f"{root}/{temporary}/{uuid.uuid4().hex}"
        self._made_folders: set[str] = set()

    def prepare(self) -> None:
        """Create the root and its folder for temporary files."""
        folder = Path(self._temporary_path).parent
        with _file_errors(str(folder)):
            folder.mkdir(parents=True, exist_ok=True)

    def write(self, files: Iterable[tuple[str, bytes]]) -> None:
        for path, content in files:
            self.stream(path, (content,))

    def stream(self, path: str, pieces: Iterable[bytes]) -> None:
        full_path = self._path(path)
        with self._write_temporary(full_path, pieces):
            os.rename(self._temporary_path, full_path)

    def create(self, path: str, content: bytes) -> bool:
        full_path = self._path(path)
        with self._write_temporary(full_path, (content,)):
            try:
                return _move_if_absent(self._temporary_path, full_path)
            finally:
                with contextlib.suppress(FileNotFoundError):
                    os.unlink(self._temporary_path)

    def read(self, path: str) -> bytes | None:
        with _file_errors(self._path(path)):
            try:
                return Path(self.root, path).read_bytes()
            except (FileNotFoundError, NotADirectoryError):
                return None

    def pieces(self, path: str) -> Iterator[bytes]:
        with (
            _file_errors(self._path(path)),
            contextlib.suppress(FileNotFoundError, NotADirectoryError),
        ):
            yield from atomic_files.read_chunks(Path(self.root, path))

    def names(self, folder: str) -> set[str]:
        with _file_errors(self._path(folder)):
            try:
                return set(os.listdir(self._path(folder)))
            except FileNotFoundError:
                return set()

    def holds(self, path: str, size: int) -> bool:
        """Return whether a file exists with this size; after a power cut it may be empty."""
        try:
            return os.stat(self._path(path)).st_size == size
        except OSError:
            return False

    def empty(self, but: str) -> bool:
        return self.names("") <= {but}

    def drop(self, path: str) -> None:
        with _file_errors(self._path(path)):
            Path(self._path(path)).unlink(missing_ok=True)

    def remove(self, folder: str) -> None:
        """Remove a folder and its content; FileError if that fails repeatedly."""
        for _ in range(TRIES):
            shutil.rmtree(self._path(folder), ignore_errors=True)
            if not Path(self.root, folder).exists():
                return
            time.sleep(PAUSE)
        raise FileError(self._path(folder), "cannot be taken away")

    def _path(self, path: str) -> str:
        return f"{self.root}/{path}" if path else self.root

    @contextmanager
    def _write_temporary(self, full_path: str, pieces: Iterable[bytes]) -> Iterator[None]:
        """Write the pieces to the temporary file, which the caller renames."""
        with _file_errors(full_path):
            self._ensure_folder(full_path.rpartition("/")[0])
            try:
                with open(self._temporary_path, "wb") as file:
                    file.writelines(pieces)
                yield
            except BaseException:
                with contextlib.suppress(OSError):
                    os.unlink(self._temporary_path)
                raise

    def _ensure_folder(self, folder: str) -> None:
        if folder not in self._made_folders:
            Path(folder).mkdir(parents=True, exist_ok=True)
            self._made_folders.add(folder)


def _move_if_absent(temporary: str, full_path: str) -> bool:
    """Move a file to a path if none exists there; return whether it was moved."""
    try:
        os.link(temporary, full_path)
    except FileExistsError:
        return False
    except OSError as fault:
        if fault.errno not in NO_HARD_LINK_ERRORS:
            raise
        # Not atomic: two processes that begin at once may both find no file; the later one's
        # remains.
        if os.path.exists(full_path):
            return False
        os.rename(temporary, full_path)
    return True


@contextmanager
def _file_errors(path: str) -> Iterator[None]:
    """Convert errors of the file system to FileError for this path."""
    try:
        yield
    except OSError as fault:
        raise FileError(path, f"cannot be written or read: {fault.strerror}") from fault
