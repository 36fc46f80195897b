"""Suggested points, as plain values and as a text table."""

from typing import Any

from service.motion.answer import Suggestion, Suggestions

DECIMALS = 9
"""Decimals that do not depend on the machine that solved the kriging system."""
HEADING = ("gain", "variance", "lacks", "nearest clip", "controls")


def plain(found: Suggestions) -> dict[str, Any]:
    """Return the suggestions in the schema Suggestions of the API."""
    return {
        "model": found.model,
        "performer": found.performer,
        "candidates": found.candidates,
        "suggestions": [_plain(each) for each in found.suggestions],
    }


def _plain(found: Suggestion) -> dict[str, Any]:
    rounded = {n: round(getattr(found, n), DECIMALS) for n in ("gain", "variance", "gap")}
    return {**vars(found), **rounded}


def text(found: Suggestions) -> str:
    """Return one line for each point, the largest gain first."""
    rows = [HEADING, *map(_cells, found.suggestions)]
    widths = [max(len(row[i]) for row in rows) for i in range(len(HEADING))]
    lines = ("  ".join(c.ljust(w) for c, w in zip(row, widths, strict=True)) for row in rows)
    return "\n".join(line.rstrip() for line in lines)


def _cells(found: Suggestion) -> tuple[str, ...]:
    controls = ", ".join(f"{name} {value:.4g}" for name, value in found.controls.items())
    return (
        f"{100 * found.gain:.1f} %",
        f"{found.variance:.2f}",
        f"{found.lacking} ({100 * found.gap:.0f} % of its range)",
        found.nearest or "",
        controls,
    )
