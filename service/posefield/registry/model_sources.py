"""Sources of models: files and folders of them, listed repeatedly.

A folder contains NAME.onnx, NAME/VERSION.onnx or NAME/VERSION/model.onnx, as model servers lay them
out. Names that begin with a dot are ignored as temporary files.
"""

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from pathlib import Path, PurePosixPath
from urllib.parse import unquote, urlsplit

from posefield.common.errors import ModelError
from posefield.model_file import checked_file

URL = re.compile(r"[a-z][a-z0-9+.-]*://", re.IGNORECASE)
MODEL_SUFFIX = ".onnx"
VERSION_FILE = f"model{MODEL_SUFFIX}"

VersionOrder = tuple[tuple[str | int, ...], str]


@dataclass(frozen=True)
class ModelFile:
    """A model file as its source listed it.

    location: its path or URL. name: of the model. version: the part of the path that names the
    version, empty without versions. signature: differs whenever the content does. read: returns the
    content, or raises ModelError.
    """

    location: str
    name: str
    version: str
    signature: str
    read: Callable[[], bytes]

    @property
    def order(self) -> VersionOrder:
        """Sort key of versions, the newest last; digits compare as numbers."""
        pieces = re.split(r"(\d+)", self.version)
        return tuple(int(p) if i % 2 else p for i, p in enumerate(pieces)), self.version


Source = Callable[[], list[ModelFile]]
"""Returns the present files of a source; ModelError if there are none or the source fails."""


def parse_model_path(path: str) -> tuple[str, str] | None:
    """Return the name and version of a model file by its path in a folder, else None."""
    names = PurePosixPath(path).parts
    if any(name.startswith(".") for name in names) or not path.endswith(MODEL_SUFFIX):
        return None
    if len(names) == 1:
        return names[0].removesuffix(MODEL_SUFFIX), ""
    if len(names) == 2:
        return names[0], names[1].removesuffix(MODEL_SUFFIX)
    return names[:2] if len(names) == 3 and names[2] == VERSION_FILE else None


def file_source(path: Path) -> list[ModelFile]:
    """Return the model of one file."""
    return [_model_file(path, path.stem, "")]


def folder_source(path: Path) -> list[ModelFile]:
    """Return the model files in a folder, and in its folders with versions of one model each."""
    patterns = ("", "*/", "*/*/")
    paths = [file for deep in patterns for file in sorted(path.glob(f"{deep}*{MODEL_SUFFIX}"))]
    names = [(file, parse_model_path(file.relative_to(path).as_posix())) for file in paths]
    files = [_model_file(file, *name) for file, name in names if name]
    if not files:
        raise ModelError(path, f"no {MODEL_SUFFIX} file in this folder")
    return files


def path_source(location: str | Path) -> Source:
    """Return the source of a path or a file:/// URL."""
    text = str(location)
    path = Path(unquote(urlsplit(text).path) if URL.match(text) else location)
    return partial(folder_source if path.is_dir() else file_source, path)


def group_by_name(files: Iterable[ModelFile]) -> dict[str, list[ModelFile]]:
    """Return the versions of each name, the newest first."""
    grouped: dict[str, list[ModelFile]] = {}
    for file in files:
        grouped.setdefault(file.name, []).append(file)
    return {
        name: sorted(versions, key=lambda file: file.order, reverse=True)
        for name, versions in grouped.items()
    }


def _model_file(path: Path, name: str, version: str) -> ModelFile:
    try:
        status = path.stat()
    except OSError as error:
        raise ModelError(path, f"cannot be read: {error.strerror}") from error
    # Replacing a file by renaming changes its inode; writing into it changes its time.
    signature = f"{status.st_ino} {status.st_size} {status.st_mtime_ns}"
    return ModelFile(str(path), name, version, signature, partial(checked_file.read, path))
