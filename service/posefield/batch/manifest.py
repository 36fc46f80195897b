"""Manifest of an export: one entry for each written clip."""

import hashlib
from typing import Any

import orjson

from posefield.question.results import ClipAnswer


def entry(name: str, file: str, content: bytes, answer: ClipAnswer) -> dict[str, Any]:
    """Return the manifest entry of a clip as plain values: path, checksum, frames and trust.

    file: path relative to the manifest. content: the file's bytes.
    """
    facts = answer.trust.document()
    return {
        "name": name,
        "file": file,
        "bytes": len(content),
        "sha256": hashlib.sha256(content).hexdigest(),
        "frames": len(answer.clip),
        "fps": answer.clip.rate,
        **facts,
    }


def line(found: dict[str, Any]) -> bytes:
    """Return an entry as a line of JSON Lines."""
    return orjson.dumps(found, option=orjson.OPT_APPEND_NEWLINE)
