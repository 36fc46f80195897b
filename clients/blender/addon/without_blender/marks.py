"""Support and performer of a clip's trust in words; None from services that do not report them."""

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Mark:
    """A sentence. held: True for the favourable case."""

    held: bool
    words: str


def support(trust: dict[str, Any]) -> Mark | None:
    """Return the mark of clips captured near the controls; None if not reported."""
    found = trust.get("supported")
    if found is None:
        return None
    return Mark(found, "Captured near here" if found else "Nothing like it was captured")


def performer(trust: dict[str, Any]) -> Mark | None:
    """Return the mark of a captured performer; None if not reported.

    Models without performers do not report one.
    """
    found = trust.get("performer_seen")
    if found is None:
        return None
    known = f"{trust['performer']} was captured"
    return Mark(found, known if found else "Moves as an unseen performer")
