"""The models a service answers for: loaded once, read-only afterwards."""

import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from service.motion.errors import ModelError, UnknownModel
from service.synthesis import session
from service.synthesis.synthesizer import Synthesizer

NAME = re.compile(r"[a-z0-9][a-z0-9_-]{0,63}")


@dataclass(frozen=True)
class Library:
    """Models by name."""

    models: dict[str, Synthesizer]

    def find(self, key: str) -> Synthesizer:
        """Model of a name or a name@contenthash; UnknownModel when it is not here."""
        model = self.models.get(key.partition("@")[0])
        if model is None or key not in (model.name, model.identity):
            known = ", ".join(m.identity for m in self.models.values())
            raise UnknownModel("model", f"no model {key!r}; there are {known}")
        return model


def load(paths: Iterable[Path]) -> Library:
    """Library of .onnx files and of the .onnx files in folders, named by their stems.

    Raises ModelError for a path with no model, a file that cannot be served, a stem that cannot
    stand in a URL, and two files of one stem.
    """
    models: dict[str, Synthesizer] = {}
    for path in (file for given in paths for file in _files(given)):
        if path.stem in models:
            raise ModelError(path, f"a second model named {path.stem!r}")
        models[path.stem] = opened(path, session.read(path))
    return Library(models)


def opened(path: Path, content: bytes) -> Synthesizer:
    """Model of a file that has been read, named by its stem; raises ModelError as `load` does."""
    if not NAME.fullmatch(path.stem):
        raise ModelError(path, f"name {path.stem!r}, expected {NAME.pattern}")
    return Synthesizer(path.stem, session.open_bytes(content, str(path)))


def _files(given: Path) -> list[Path]:
    if not given.is_dir():
        return [given]
    files = sorted(given.glob("*.onnx"))
    if not files:
        raise ModelError(given, "no .onnx file in this folder")
    return files
