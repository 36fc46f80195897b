"""What a model can be asked at all: the same for one character and for a crowd of them."""

import math
from collections.abc import Iterable

from service.motion.card import Control, ModelCard
from service.motion.errors import InvalidField

# A clip this many times longer or shorter than any that was captured is no motion any more.
FARTHEST = 10.0


def check_names(card: ModelCard, names: Iterable[str]) -> None:
    """InvalidField for the first control that a model does not have."""
    for name in names:
        if card.control(name) is None:
            known = ", ".join(c.name for c in card.controls)
            raise InvalidField(f"controls/{name}", f"no such control; this model has {known}")


def reach(control: Control) -> tuple[float, float]:
    """Lowest and highest value that is answered: beyond, float32 would overflow."""
    room = 100.0 * (control.maximum - control.minimum)
    return control.minimum - room, control.maximum + room


def sampled(control: Control) -> tuple[float, float]:
    """Lowest and highest value that was sampled, within the width of a rounding error in what a
    client read from the card."""
    slack = 1e-6 * (control.maximum - control.minimum)
    return control.minimum - slack, control.maximum + slack


def durations(card: ModelCard) -> tuple[float, float]:
    """Shortest and longest clip, s, that extrapolation has not lost all sense in."""
    low, high = card.durations
    return low / FARTHEST, high * FARTHEST


def senseless(card: ModelCard, duration: float) -> str:
    """What to say of controls by which a clip would last so long, s."""
    low, high = card.durations
    return (
        f"so far outside what was sampled that the clip would last {duration:.3g} s; "
        f"captured clips last {low:.3g} to {high:.3g} s"
    )


def known(performers: tuple[str, ...]) -> str:
    """Who may be asked for."""
    return f"one of {', '.join(performers)}" if performers else "none: this model knows none"


def number(field: str, value: object) -> float:
    """Finite number; InvalidField where the value is none."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InvalidField(field, f"{value!r}, expected a number")
    try:
        found = float(value)
    except OverflowError:
        found = math.inf
    if not math.isfinite(found):
        raise InvalidField(field, f"{found}, expected a finite number")
    return found


def within(field: str, value: float, low: float, high: float, unit: str) -> None:
    """InvalidField for a value that is not from low to high."""
    if not low <= value <= high:
        raise InvalidField(field, f"{value:g} {unit}, expected {low:g} to {high:g} {unit}")
