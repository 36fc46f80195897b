"""Atomic writing of files and folders: either complete or absent.

They are made in hidden folders beside their places. A folder is locked while its process lives, so
the next one that writes the same file removes the folders of those that were killed.
"""

import hashlib
import os
import shutil
from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager
from contextvars import ContextVar
from pathlib import Path
from tempfile import TemporaryDirectory

from posefield.common.errors import FileError

CHUNK_BYTES = 1 << 20
Moves = list[tuple[Path, Path]]
"""New files and folders, and their places."""
_together: ContextVar[tuple[ExitStack, Moves] | None] = ContextVar("together", default=None)


def read_chunks(path: Path) -> Iterator[bytes]:
    """Yield the bytes of a file in chunks of a megabyte."""
    with path.open("rb") as file:
        while chunk := file.read(CHUNK_BYTES):
            yield chunk


def write(content: bytes, path: Path) -> None:
    """Write a file atomically: to a temporary path beside it, then renamed.

    Raises FileError if it cannot be written.
    """
    write_chunks([content], path)


def write_chunks(chunks: Iterable[bytes], path: Path) -> None:
    """Write a file atomically from chunks; no file remains if their iteration fails.

    Raises FileError if it cannot be written.
    """
    with replacing(path) as temporary, temporary.open("wb") as file:
        file.writelines(chunks)


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yield a temporary path with the name of `path`; on success its file replaces `path`.

    Raises FileError if it cannot be written.
    """
    with _moves() as (rooms, moves), _file_errors(path):
        file = _make_room(path, rooms) / path.name
        yield file
        file.chmod(0o644)
        moves.append((file, path))


@contextmanager
def replacing_pair(path: Path, folder: Path) -> Iterator[tuple[Path, Path]]:
    """Yield a temporary path and an empty folder, which on success replace `path` and `folder`.

    The folder is replaced first, so that the file never refers to missing ones. After an error the
    previous file and folder are kept or restored. Raises FileError if they cannot be written.
    """
    with _moves() as (rooms, moves), _file_errors(path):
        file = _make_room(path, rooms) / path.name
        new = file.with_name("new")
        new.mkdir()
        yield file, new
        file.chmod(0o644)
        moves += [(new, folder), (file, path)]


@contextmanager
def together() -> Iterator[None]:
    """Replace all files that are written in this block at its end, or none after an error."""
    with _moves() as both:
        token = _together.set(both)
        try:
            yield
        finally:
            _together.reset(token)


@contextmanager
def _moves() -> Iterator[tuple[ExitStack, Moves]]:
    """Yield the temporary folders and the moves of a block, which are done at its end."""
    if (outer := _together.get()) is not None:
        yield outer
        return
    with ExitStack() as rooms:
        moves = Moves()
        yield rooms, moves
        _replace(moves)


@contextmanager
def temporary_folder(path: Path) -> Iterator[Path]:
    """Yield a temporary folder beside the path, on the same disk; FileError if it cannot be."""
    with ExitStack() as rooms, _file_errors(path):
        yield _make_room(path, rooms)


@contextmanager
def _file_errors(path: Path) -> Iterator[None]:
    try:
        yield
    except OSError as fault:
        raise FileError(path, f"cannot be written: {fault.strerror}") from fault


def _make_room(path: Path, rooms: ExitStack) -> Path:
    """Return a new locked folder beside the path; those of killed processes are removed."""
    path.parent.mkdir(parents=True, exist_ok=True)
    prefix = f".writing.{hashlib.sha256(os.fsencode(path.name)).hexdigest()[:12]}."
    for folder in path.parent.glob(f"{prefix}*"):
        with ExitStack() as lock:
            if _lock(folder, lock):
                shutil.rmtree(folder, ignore_errors=True)
    room = Path(rooms.enter_context(TemporaryDirectory(dir=path.parent, prefix=prefix)))
    _lock(room, rooms)
    return room


def _lock(folder: Path, locks: ExitStack) -> bool:
    """Lock a folder until the end of `locks`; return whether it could be."""
    try:
        import fcntl  # Not on Windows, where the folders of killed processes stay.

        descriptor = os.open(folder, os.O_RDONLY)
        locks.callback(os.close, descriptor)
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except (ImportError, OSError):  # Locked by another process, gone, or on a disk without locks.
        return False
    return True


def _replace(moves: Moves) -> None:
    """Move files and folders over earlier ones: all, or none after an error."""
    done = list[tuple[Path, Path, Path]]()
    try:
        for new, path in moves:
            old = new.with_name(f"{new.name}.old")
            with _file_errors(path):
                # The last file replaces the earlier one at once, so that it is never missing.
                last = new.is_file() and len(done) + 1 == len(moves)
                if not last and path.exists() and path.is_dir() == new.is_dir():
                    path.rename(old)
                done.append((new, path, old))
                new.replace(path)
    except BaseException:
        for new, path, old in reversed(done):
            if not new.exists():
                path.replace(new)
            if old.exists():
                old.rename(path)
        raise
