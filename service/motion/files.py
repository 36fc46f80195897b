"""Files that are whole or not there."""

import os
import tempfile
from pathlib import Path

from service.motion.errors import FileError


def write(content: bytes, path: Path) -> None:
    """Put a whole file in place, or none: it is written beside its place and renamed.

    Raises FileError where it cannot be.
    """
    try:
        _write(content, path)
    except OSError as fault:
        raise FileError(path, f"cannot be written: {fault.strerror}") from fault


def _write(content: bytes, path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    descriptor, temporary = tempfile.mkstemp(dir=path.parent, prefix=".writing.")
    try:
        with os.fdopen(descriptor, "wb") as file:
            file.write(content)
        Path(temporary).chmod(0o644)
        Path(temporary).replace(path)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise
