"""What a clip's trust says was captured, in words; nothing where an older service does not say."""

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Mark:
    """A sentence, and whether it is the good one of two."""

    held: bool
    words: str


def support(trust: dict[str, Any]) -> Mark | None:
    """Whether anything like the clip was captured."""
    found = trust.get("supported")
    if found is None:
        return None
    return Mark(found, "Captured near here" if found else "Nothing like it was captured")


def performer(trust: dict[str, Any]) -> Mark | None:
    """Whether who moves was captured; None too where a model tells nobody apart."""
    found = trust.get("performer_seen")
    if found is None:
        return None
    known = f"{trust['performer']} was captured"
    return Mark(found, known if found else "Moves as somebody never captured")
