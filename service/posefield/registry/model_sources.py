"""Sources of models: files, folders of them, and object stores, listed repeatedly.

A folder contains NAME.onnx, NAME/VERSION.onnx or NAME/VERSION/model.onnx, as model servers lay them
out. Names that begin with a dot are ignored as temporary files.
"""

import re
from collections.abc import Iterable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Protocol
from urllib.parse import unquote, urlsplit

from posefield.common.errors import ModelError
from posefield.model_file import checked_file
from posefield.registry.listed_models import MODEL_SUFFIX, ModelFile, parse_model_path

URL = re.compile(r"[a-z][a-z0-9+.-]*://", re.IGNORECASE)


class Source(Protocol):
    """Source of model files."""

    def scan(self) -> list[ModelFile]:
        """Return the present files; ModelError if there are none or the source fails."""


@dataclass(frozen=True)
class FileSource:
    """Source of one model file."""

    path: Path

    def scan(self) -> list[ModelFile]:
        """Return the file."""
        return [_model_file(self.path, self.path.stem, "")]


@dataclass(frozen=True)
class FolderSource:
    """Folder of model files and of folders with versions of one model each."""

    path: Path

    def scan(self) -> list[ModelFile]:
        """Return the model files in the folder; ModelError if there are none."""
        patterns = ("", "*/", "*/*/")
        paths = [p for deep in patterns for p in sorted(self.path.glob(f"{deep}*{MODEL_SUFFIX}"))]
        placed = [(p, parse_model_path(p.relative_to(self.path).as_posix())) for p in paths]
        found = [_model_file(path, *place) for path, place in placed if place]
        if not found:
            raise ModelError(self.path, f"no {MODEL_SUFFIX} file in this folder")
        return found


def open_source(place: str | Path) -> Source:
    """Return the source of a path, a file:/// URL or, through obstore, an object store's URL."""
    text = str(place)
    if URL.match(text):
        url = urlsplit(text)
        if url.scheme != "file":
            # Imported here because obstore is an optional extra.
            from posefield.registry.object_store import ObjectStoreSource

            return ObjectStoreSource(text)
        place = unquote(url.path)
    path = Path(place)
    return FolderSource(path) if path.is_dir() else FileSource(path)


def group_by_name(found: Iterable[ModelFile]) -> dict[str, list[ModelFile]]:
    """Return the versions of each name, the newest first."""
    grouped: dict[str, list[ModelFile]] = {}
    for one in found:
        grouped.setdefault(one.name, []).append(one)
    return {
        name: sorted(versions, key=lambda one: one.order, reverse=True)
        for name, versions in grouped.items()
    }


def _model_file(path: Path, name: str, version: str) -> ModelFile:
    try:
        facts = path.stat()
    except OSError as fault:
        raise ModelError(path, f"cannot be read: {fault.strerror}") from fault
    # Replacing a file by renaming changes its inode; writing into it changes its time.
    signature = f"{facts.st_ino} {facts.st_size} {facts.st_mtime_ns}"
    return ModelFile(str(path), name, version, signature, partial(checked_file.read, path))
