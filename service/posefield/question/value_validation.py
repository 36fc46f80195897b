"""Validation of single values; all functions raise InvalidField."""

import math

from posefield.common.errors import InvalidField
from posefield.question.motion_question import MAX_TAKE

FLOAT32_EPSILON = 2.0**-23
"""Relative error of a number in single precision."""


def check_number(field: str, value: object) -> float:
    """Return a finite number, 0 for -0.

    Raises InvalidField for any other value.
    """
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InvalidField(field, f"{value!r}, expected a number")
    try:
        found = float(value)
    except OverflowError:
        found = math.inf
    if not math.isfinite(found):
        raise InvalidField(field, f"{found}, expected a finite number")
    return found + 0.0


def check_range(field: str, value: float, low: float, high: float, unit: str) -> None:
    """Raise InvalidField for a value outside low to high."""
    if not low <= value <= high:
        # Nine digits tell any two numbers of single precision apart.
        shown = f"{check_number(field, value):.9g}"
        raise InvalidField(field, f"{shown} {unit}, expected {low:.9g} to {high:.9g} {unit}")


def check_rounded_range(field: str, value: float, low: float, high: float, unit: str) -> float:
    """Return the value, or `high` for a value that is `high` rounded to single precision.

    Clients read durations from responses, and many keep them as float32. Raises InvalidField for a
    value outside low to high.
    """
    if high < value <= high * (1.0 + FLOAT32_EPSILON):
        return high
    check_range(field, value, low, high, unit)
    return value


def check_take(seed: int, variety: float) -> None:
    """Raise InvalidField for the seed or the variety of a take out of range."""
    if not 0 <= seed <= MAX_TAKE:
        raise InvalidField("take", f"{seed}, expected 0 to {MAX_TAKE}")
    if not 0.0 <= variety <= 1.0:
        raise InvalidField("variety", f"{variety:g}, expected 0 to 1")
