"""Sources of models: files, folders of them, and object stores, listed repeatedly.

A folder contains NAME.onnx, NAME/VERSION.onnx or NAME/VERSION/model.onnx, as model servers lay them
out. Names that begin with a dot are ignored as temporary files.
"""

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from pathlib import Path, PurePosixPath
from typing import Protocol
from urllib.parse import unquote, urlsplit

from service.motion.errors import ModelError
from service.synthesis import model_file

ENDING = ".onnx"
INNERMOST = f"model{ENDING}"
URL = re.compile(r"[a-z][a-z0-9+.-]*://", re.IGNORECASE)

Order = tuple[tuple[str | int, ...], str]


@dataclass(frozen=True)
class Found:
    """A model file as its source listed it.

    place: its path or URL. name: of the model. version: the part of the path that names the
    version, empty without versions. signature: differs whenever the content does. read: returns the
    content, or raises ModelError.
    """

    place: str
    name: str
    version: str
    signature: str
    read: Callable[[], bytes]

    @property
    def order(self) -> Order:
        """Sort key of versions, the newest last; digits compare as numbers."""
        parts = re.split(r"(\d+)", self.version)
        return tuple(int(p) if i % 2 else p for i, p in enumerate(parts)), self.version


class Source(Protocol):
    """Source of model files."""

    def look(self) -> list[Found]:
        """Return the present files; ModelError if there are none or the source fails."""


@dataclass(frozen=True)
class File:
    """Source of one model file."""

    path: Path

    def look(self) -> list[Found]:
        """Return the file."""
        return [_found(self.path, self.path.stem, "")]


@dataclass(frozen=True)
class Folder:
    """Folder of model files and of folders with versions of one model each."""

    path: Path

    def look(self) -> list[Found]:
        """Return the model files in the folder; ModelError if there are none."""
        patterns = ("", "*/", "*/*/")
        paths = [p for deep in patterns for p in sorted(self.path.glob(f"{deep}*{ENDING}"))]
        placed = [(p, named(p.relative_to(self.path).as_posix())) for p in paths]
        found = [_found(path, *place) for path, place in placed if place]
        if not found:
            raise ModelError(self.path, f"no {ENDING} file in this folder")
        return found


def source(place: str | Path) -> Source:
    """Return the source of a path, a file:/// URL or, through obstore, an object store's URL."""
    text = str(place)
    if URL.match(text):
        url = urlsplit(text)
        if url.scheme != "file":
            # Imported here because obstore is an optional extra.
            from service.synthesis.objects import Objects

            return Objects(text)
        place = unquote(url.path)
    path = Path(place)
    return Folder(path) if path.is_dir() else File(path)


def named(path: str) -> tuple[str, str] | None:
    """Return the name and version of a model file by its path in a folder, else None."""
    parts = PurePosixPath(path).parts
    if any(part.startswith(".") for part in parts) or not path.endswith(ENDING):
        return None
    if len(parts) == 1:
        return parts[0].removesuffix(ENDING), ""
    if len(parts) == 2:
        return parts[0], parts[1].removesuffix(ENDING)
    return parts[:2] if len(parts) == 3 and parts[2] == INNERMOST else None


def by_name(found: Iterable[Found]) -> dict[str, list[Found]]:
    """Return the versions of each name, the newest first."""
    grouped: dict[str, list[Found]] = {}
    for one in found:
        grouped.setdefault(one.name, []).append(one)
    return {
        name: sorted(versions, key=lambda one: one.order, reverse=True)
        for name, versions in grouped.items()
    }


def _found(path: Path, name: str, version: str) -> Found:
    try:
        facts = path.stat()
    except OSError as fault:
        raise ModelError(path, f"cannot be read: {fault.strerror}") from fault
    # Replacing a file by renaming changes its inode; writing into it changes its time.
    signature = f"{facts.st_ino} {facts.st_size} {facts.st_mtime_ns}"
    return Found(str(path), name, version, signature, partial(model_file.read, path))
