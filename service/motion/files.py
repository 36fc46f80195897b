"""Files that are whole or not there."""

import os
import tempfile
from pathlib import Path


def write(content: bytes, path: Path) -> None:
    """Put a whole file in place, or none: it is written beside its place and renamed."""
    path.parent.mkdir(parents=True, exist_ok=True)
    descriptor, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(descriptor, "wb") as file:
            file.write(content)
        Path(temporary).chmod(0o644)
        Path(temporary).replace(path)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise
