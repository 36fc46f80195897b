"""Model files as their sources list them, and the name and version that a path gives."""

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import PurePosixPath

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
        parts = re.split(r"(\d+)", self.version)
        return tuple(int(p) if i % 2 else p for i, p in enumerate(parts)), self.version


def parse_model_path(path: str) -> tuple[str, str] | None:
    """Return the name and version of a model file by its path in a folder, else None."""
    parts = PurePosixPath(path).parts
    if any(part.startswith(".") for part in parts) or not path.endswith(MODEL_SUFFIX):
        return None
    if len(parts) == 1:
        return parts[0].removesuffix(MODEL_SUFFIX), ""
    if len(parts) == 2:
        return parts[0], parts[1].removesuffix(MODEL_SUFFIX)
    return parts[:2] if len(parts) == 3 and parts[2] == VERSION_FILE else None
