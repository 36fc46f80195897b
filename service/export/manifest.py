"""What is said of each clip that was written."""

import hashlib
from typing import Any

import orjson

from service.motion.answer import ClipAnswer


def entry(name: str, file: str, content: bytes, answer: ClipAnswer) -> dict[str, Any]:
    """The clip of a file as plain values: where it lies, how it can be checked, what it shows.

    file: path beside the manifest. content: the file's bytes.
    """
    facts = answer.trust.facts()
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
    """An entry as a line of the manifest, which is JSON Lines."""
    return orjson.dumps(found, option=orjson.OPT_APPEND_NEWLINE)
