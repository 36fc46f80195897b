"""Header lists with weights from 0 to 1 (quality values, RFC 9110, 12.4.2)."""

import re

_WEIGHT = re.compile(r"q=(0(?:\.[0-9]{0,3})?|1(?:\.0{0,3})?)", re.IGNORECASE)


def weighted(header: str) -> list[tuple[str, float]]:
    """Return the names, in lower case, and their weights; 1 for a missing or invalid weight."""
    return [_weighted(part) for part in header.split(",") if part.strip()]


def _weighted(part: str) -> tuple[str, float]:
    name, *parameters = (piece.strip() for piece in part.split(";"))
    weights = [found for found in map(_WEIGHT.fullmatch, parameters) if found]
    return name.lower(), float(weights[0][1]) if weights else 1.0
