"""Limits of a model's inputs, shared by questions for one character and for crowds."""

from collections.abc import Iterable

from posefield.common.errors import InvalidField
from posefield.common.name_suggestion import did_you_mean, similar_name
from posefield.model_file.model_card import Control, ModelCard
from posefield.question.motion_question import FileQuestion, PoseQuestion
from posefield.question.text_decoding import parameters

# A clip this many times longer or shorter than any captured one is no plausible motion.
DURATION_FACTOR = 10.0


def check_names(card: ModelCard, names: Iterable[str]) -> None:
    """Raise InvalidField for the first name that is not a control of the model."""
    for name in names:
        if card.control(name) is None:
            own = [c.name for c in card.controls]
            hint = did_you_mean(name, own) or _option_hint(name)
            raise InvalidField(
                f"controls/{name}", f"no such control{hint}; this model has {', '.join(own)}"
            )


def _option_hint(name: str) -> str:
    """Return the text about an option that is similar to a name, or "".

    In a query string each name that is no option is taken for a control.
    """
    forms = (PoseQuestion, FileQuestion)
    found = similar_name(name, [word for form in forms for word in parameters(form)])
    return "" if found is None else f" (did you mean the option {found!r}?)"


def accepted_range(control: Control) -> tuple[float, float]:
    """Return the lowest and the highest accepted value of a control.

    The limits prevent overflow of float32.
    """
    room = 100.0 * (control.maximum - control.minimum)
    return control.minimum - room, control.maximum + room


def sampled_range(control: Control) -> tuple[float, float]:
    """Return the lowest and the highest sampled value of a control.

    A slack of a millionth of the range allows for rounding of values that a client read from the
    card.
    """
    slack = 1e-6 * (control.maximum - control.minimum)
    return control.minimum - slack, control.maximum + slack


def duration_range(card: ModelCard) -> tuple[float, float]:
    """Return the shortest and the longest plausible duration of a clip, s."""
    low, high = card.durations
    return low / DURATION_FACTOR, high * DURATION_FACTOR


def implausible_duration(card: ModelCard, duration: float) -> str:
    """Return the message for controls that lead to an implausible duration, s."""
    low, high = card.durations
    return (
        f"so far outside what was sampled that the clip would last {duration:.3g} s; "
        f"captured clips last {low:.3g} to {high:.3g} s"
    )


def accepted_names(performers: tuple[str, ...]) -> str:
    """Return the accepted performers as text for a message."""
    return f"one of {', '.join(performers)}" if performers else "none: this model knows none"
