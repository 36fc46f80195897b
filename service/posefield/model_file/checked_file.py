"""Reading of model files: limited in size, and checked before onnxruntime opens them.

docs/decisions/0022-model-file-checks.md states the purpose of each check.
"""

import hashlib
import os
import stat
from pathlib import Path

from posefield.common.errors import ModelError
from posefield.model_file import card_check, card_reader, checksum, onnx_check
from posefield.model_file.model_card import ModelCard

MAX_BYTES = 64 << 20
"""Largest size of a file. A model of 92 clips has 110 kB, one of 2,000 about 20 MB."""
NO_CHECKSUM = (
    "does not end with its checksum: it is damaged, another program has written it, or it is older "
    "than checksums; expected a file as posefield wrote it"
)


def read(path: Path) -> bytes:
    """Return the content of a model file; ModelError if it cannot be read or is too large."""
    try:
        with open(path, "rb", opener=_open_nonblocking) as it:
            facts = os.fstat(it.fileno())
            if not stat.S_ISREG(facts.st_mode):
                raise ModelError(path, "cannot be read: not a regular file")
            check_size(facts.st_size, path)
            return it.read(facts.st_size)
    except OSError as fault:
        raise ModelError(path, f"cannot be read: {fault.strerror}") from fault


def _open_nonblocking(path: str, flags: int) -> int:
    """Open a file without blocking, so that a named pipe does not wait for its writer."""
    return os.open(path, flags | os.O_NONBLOCK)


def check_size(size: int, source: str | Path) -> None:
    """Raise ModelError for a size above MAX_BYTES."""
    if size > MAX_BYTES:
        raise ModelError(source, f"cannot be read: {size} bytes, expected at most {MAX_BYTES}")


def load_card(content: bytes, source: str) -> ModelCard:
    """Return the card of a file with a valid checksum, graph and card; ModelError for any other.

    source: path or URL of the file, for messages.
    """
    check_size(len(content), source)
    if not checksum.is_valid(content):
        raise ModelError(source, NO_CHECKSUM)
    try:
        onnx = onnx_check.check(content)
        card = card_reader.decode(onnx.metadata)
        card_check.check_graph(card, onnx.shapes, onnx.values)
    except (ValueError, OverflowError) as fault:
        raise ModelError(source, str(fault)) from fault
    return card


def sha256(content: bytes) -> str:
    """Return the SHA-256 of a model file in hexadecimal digits."""
    return hashlib.sha256(content).hexdigest()


def digest(content: bytes) -> str:
    """Return the first 16 digits of the SHA-256, which identify a version of a model."""
    return sha256(content)[:16]
