"""Atomic writing of files and folders: either complete or absent."""

import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from posefield.common.errors import FileError

CHUNK_BYTES = 1 << 20


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
    with temporary_folder(path) as folder:
        yield folder / path.name
        _move_into_place(folder / path.name, path)


@contextmanager
def replacing_pair(path: Path, folder: Path) -> Iterator[tuple[Path, Path]]:
    """Yield a temporary path and an empty folder, which on success replace `path` and `folder`.

    The folder is replaced first, so that the file never refers to missing ones. After an error the
    previous file and folder are kept or restored. Raises FileError if they cannot be written.
    """
    with temporary_folder(path) as room:
        new, old = room / "new", room / "old"
        new.mkdir()
        yield room / path.name, new
        _replace_folder(new, folder, old)
        try:
            _move_into_place(room / path.name, path)
        except BaseException:
            _restore(folder, old)
            raise


@contextmanager
def temporary_folder(path: Path) -> Iterator[Path]:
    """Yield a temporary folder beside the path, on the same disk; FileError if it cannot be."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=path.parent, prefix=".writing.") as name:
            yield Path(name)
    except OSError as fault:
        raise FileError(path, f"cannot be written: {fault.strerror}") from fault


def _move_into_place(temporary: Path, path: Path) -> None:
    temporary.chmod(0o644)
    temporary.replace(path)


def _replace_folder(new: Path, folder: Path, old: Path) -> None:
    if folder.exists():
        folder.rename(old)
    try:
        new.rename(folder)
    except BaseException:
        _restore(folder, old)
        raise


def _restore(folder: Path, old: Path) -> None:
    if folder.exists():
        folder.rename(old.with_name("failed"))
    if old.exists():
        old.rename(folder)
