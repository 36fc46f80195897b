"""One defect, and the short form in which the checks state it."""

from dataclasses import dataclass
from typing import Any, Literal

Severity = Literal["error", "warning"]


@dataclass(frozen=True)
class Finding:
    """A defect of a file: its code, the path of its prim, and what was found and expected.

    An error makes some reader show the wrong motion or none; a warning only makes that likely.
    """

    code: str
    prim: str
    message: str
    severity: Severity = "error"


def error(code: str, prim: Any, message: str) -> Finding:
    """Error at a prim."""
    return Finding(code, str(prim.GetPath()), message)


def warning(code: str, prim: Any, message: str) -> Finding:
    """Warning at a prim."""
    return Finding(code, str(prim.GetPath()), message, "warning")


def some(values: list[Any]) -> str:
    """The first few of many values, for a message."""
    shown = ", ".join(str(value) for value in values[:3])
    return shown if len(values) <= 3 else f"{shown} and {len(values) - 3} more"
