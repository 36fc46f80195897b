"""Files that are whole or not there."""

import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from service.motion.errors import FileError

CHUNK = 1 << 20


def pieces(path: Path) -> Iterator[bytes]:
    """A file's bytes, a megabyte at a time."""
    with path.open("rb") as file:
        while chunk := file.read(CHUNK):
            yield chunk


def write(content: bytes, path: Path) -> None:
    """Put a whole file in place, or none: it is written beside its place and renamed.

    Raises FileError where it cannot be.
    """
    stream([content], path)


def stream(chunks: Iterable[bytes], path: Path) -> None:
    """The same for a file that comes in pieces; none is left where the pieces break off."""
    with replacing(path) as made, made.open("wb") as file:
        file.writelines(chunks)


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A path of the same name to write to; the file there then takes the place of `path`.

    Raises FileError where it cannot.
    """
    with _room(path) as room:
        yield room / path.name
        _settle(room / path.name, path)


@contextmanager
def replacing_pair(path: Path, folder: Path) -> Iterator[tuple[Path, Path]]:
    """A path and an empty folder to fill, which then take the places of `path` and `folder`.

    The folder goes first, so that the file never names what is not there. Where something fails,
    what was there before stays or comes back. Raises FileError where it cannot be done.
    """
    with _room(path) as room:
        new, old = room / "new", room / "old"
        new.mkdir()
        yield room / path.name, new
        _exchange(new, folder, old)
        try:
            _settle(room / path.name, path)
        except BaseException:
            _restore(folder, old)
            raise


@contextmanager
def _room(path: Path) -> Iterator[Path]:
    """A folder beside the path, on the same disk, that does not outlive what is done in it."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=path.parent, prefix=".writing.") as name:
            yield Path(name)
    except OSError as fault:
        raise FileError(path, f"cannot be written: {fault.strerror}") from fault


def _settle(made: Path, path: Path) -> None:
    made.chmod(0o644)
    made.replace(path)


def _exchange(new: Path, folder: Path, old: Path) -> None:
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
