"""Support, performer and curves of a clip, and weights of labels, in words."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from .label_choice import PERFORMER


@dataclass(frozen=True)
class Mark:
    """A sentence. held: True for the favourable case."""

    held: bool
    words: str


ROUNDING = 1e-6
"""Excess of a sum of weights over one that the service takes for rounding."""


def weights(given: dict[str, float]) -> Mark | None:
    """Return the mark of the sum of weights: out of range, or partly open; None for a sum of 1."""
    total = sum(given.values())
    if not 0 < total <= 1 + ROUNDING:
        return Mark(False, f"The weights' sum is {total:g}, expected one above 0 and at most 1")
    return Mark(True, f"{1 - total:.3g} of 1 is left open") if total < 1 - ROUNDING else None


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
    if PERFORMER in trust.get("labels", {}):
        return Mark(found, "Moves as a mixture of performers")
    known = f"{trust['performer']} was captured"
    return Mark(found, known if found else "Moves as an unseen performer")


def curves(names: Sequence[str]) -> Mark | None:
    """Return the mark of curves of the answer, which the add-on does not animate; None without."""
    if not names:
        return None
    return Mark(
        False,
        f"{len(names)} curves are not animated by this panel: import the clip as usdc or glb, "
        "whose shape keys have them",
    )
