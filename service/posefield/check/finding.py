"""Finding: one defect, and the functions that build it."""

from dataclasses import dataclass
from typing import Any, Literal

Severity = Literal["error", "warning"]


@dataclass(frozen=True)
class Finding:
    """Defect of a file: its code, the path of its prim, and the found and expected values.

    An error makes some reader show a wrong motion or none; a warning makes it likely.
    """

    code: str
    prim: str
    message: str
    severity: Severity = "error"


def error(code: str, prim: Any, message: str) -> Finding:
    """Return an error at a prim."""
    return Finding(code, str(prim.GetPath()), message)


def warning(code: str, prim: Any, message: str) -> Finding:
    """Return a warning at a prim."""
    return Finding(code, str(prim.GetPath()), message, "warning")


def first_values(values: list[Any]) -> str:
    """Return the first three of many values as text, for a message."""
    shown = ", ".join(str(value) for value in values[:3])
    return shown if len(values) <= 3 else f"{shown} and {len(values) - 3} more"
