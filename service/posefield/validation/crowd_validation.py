"""Validation of a crowd's controls, times and durations, column by column."""

import numpy as np

from posefield.common.errors import InvalidField, OutsideSamples
from posefield.common.units import Booleans, Floats, Indices, Singles
from posefield.kriging import random_field
from posefield.kriging.support import Support
from posefield.model_file import answer_bounds
from posefield.model_file.model_card import Control, ModelCard
from posefield.question.motion_question import MAX_TAKE
from posefield.validation import input_limits, question_validation
from posefield.validation.crowd_question import CharacterTakes, CrowdQuestion

MAX_TAKES = 2_000
"""Largest number of characters with a take; each takes up to a millisecond."""


def check_controls(
    card: ModelCard, support: Support, question: CrowdQuestion
) -> tuple[Floats, Booleans, tuple[str, ...]]:
    """Return controls (N, d) in the card's order, the support flags (N,), and warnings.

    Warnings name each control with values outside the sampled range, and points in a gap between
    samples. Raises InvalidField for unknown, missing or unusable controls, and OutsideSamples where
    `extrapolate` is "refuse".
    """
    input_limits.check_names(card, question.controls)
    columns = [_column(control, question) for control in card.controls]
    points = np.stack(columns, axis=1)
    supported = support.supported(points)
    pairs = zip(card.controls, columns, strict=True)
    found = [_range_warning(question, *pair) for pair in pairs]
    found.append(
        _gap_warning(card, support, question, points[~supported], np.flatnonzero(~supported))
    )
    said = tuple(filter(None, found)) if question.extrapolate == "warn" else ()
    return points, supported, said


def _column(control: Control, question: CrowdQuestion) -> Floats:
    field = f"controls/{control.name}"
    low, high = control.minimum, control.maximum
    if control.name not in question.controls:
        raise InvalidField(
            field,
            f"missing; give numbers in {control.unit}, sampled from {low:g} to {high:g}",
        )
    values = question.controls[control.name]
    least, most = input_limits.accepted_range(control)
    far = (values < least) | (values > most)
    expected = f"{control.unit}, expected {least:g} to {most:g} {control.unit}"
    raise_for_first(field, values, far, expected)
    return values


def _range_warning(question: CrowdQuestion, control: Control, values: Floats) -> str | None:
    """Return the warning for values of a control outside the sampled range, or None.

    Raises OutsideSamples instead where `extrapolate` is "refuse".
    """
    low, high = input_limits.sampled_range(control)
    beyond = (values < low) | (values > high)
    if not beyond.any():
        return None
    first = int(np.argmax(beyond))
    said = (
        f"{control.name} of {np.count_nonzero(beyond)} characters lies outside what was sampled, "
        f"{control.minimum:g} to {control.maximum:g} {control.unit}; "
        f"the first is character {first}, {values[first]:g} {control.unit}"
        f"{_limited_part(control, values)}"
    )
    if question.extrapolate == "refuse":
        raise OutsideSamples(f"controls/{control.name}", said, first)
    return said


def _limited_part(control: Control, values: Floats) -> str:
    """Return the part of a warning that tells at which value the farthest values act."""
    ends = float(values.min()), float(values.max())
    acting = [answer_bounds.limit_control(control, value) for value in ends]
    limited = [f"{own:.4g}" for own, value in zip(acting, ends, strict=True) if own != value]
    return f"; values further out act as {' or '.join(limited)} {control.unit}" if limited else ""


def _gap_warning(
    card: ModelCard, support: Support, question: CrowdQuestion, points: Floats, who: Indices
) -> str | None:
    """Return the warning for unsupported points (U, d) within the sampled ranges, or None.

    who: their characters' indices (U,). Raises OutsideSamples instead where `extrapolate` is
    "refuse".
    """
    low, high = np.transpose([input_limits.sampled_range(control) for control in card.controls])
    inside = np.all((points >= low) & (points <= high), axis=1)
    if not inside.any():
        return None
    first = int(who[inside][0])
    variance = float(support.variance(points[inside][:1])[0])
    count = f"{np.count_nonzero(inside)} characters; the first, character {first}, lies"
    said = question_validation.gap_warning(count, variance, support.limit)
    if question.extrapolate == "refuse":
        raise OutsideSamples("controls", said, first)
    return said


def raise_for_first(field: str, values: Floats, bad: Booleans, expected: str) -> None:
    """Raise InvalidField for the first character whose entry of `bad` (N,) is true."""
    if bad.any():
        first = int(np.argmax(bad))
        raise InvalidField(field, f"{values[first]:.9g} {expected}", first)


def check_takes(card: ModelCard, question: CrowdQuestion) -> CharacterTakes:
    """Return the takes of the characters; detail is false where the model has none.

    Raises InvalidField for a seed or a variety out of range, for more takes than `MAX_TAKES`, and
    for a model without takes.
    """
    count = len(question)
    none = CharacterTakes(np.zeros(count, np.int64), np.zeros(count), np.zeros(count, dtype=bool))
    found = question.takes or none
    seeds, variety = found.seeds, found.variety
    outside = (seeds < 0) | (seeds > MAX_TAKE)
    raise_for_first("take", seeds.astype(float), outside, f"expected 0 to {MAX_TAKE}")
    raise_for_first("variety", variety, (variety < 0.0) | (variety > 1.0), "expected 0 to 1")
    taken = int(np.count_nonzero(seeds))
    if taken > MAX_TAKES:
        raise InvalidField("take", f"{taken} characters with takes, expected at most {MAX_TAKES}")
    if taken and not random_field.has_features(card.kriging):
        name = card.kriging.covariance
        raise InvalidField("take", f"given, but no takes can be drawn of {name} kriging")
    return CharacterTakes(seeds, variety, found.detail & bool(card.making.detail))


def check_times(times: Floats, durations: Singles, slack: Floats) -> None:
    """Raise InvalidField for the first character whose time (s) is after the end of its clip.

    slack (N,): tolerated excess as a share of the duration.
    """
    late = times > durations * (1.0 + slack)
    if late.any():
        first = int(np.argmax(late))
        expected = f"expected 0 to {durations[first]:.9g} s"
        raise InvalidField("time", f"{times[first]:.9g} s, {expected}", first)


def check_durations(card: ModelCard, durations: Singles) -> None:
    """Raise OutsideSamples for the first character with an implausible duration, s."""
    low, high = input_limits.duration_range(card)
    senseless = ~((durations >= low) & (durations <= high))
    if senseless.any():
        first = int(np.argmax(senseless))
        raise OutsideSamples(
            "controls", input_limits.implausible_duration(card, durations[first]), first
        )
