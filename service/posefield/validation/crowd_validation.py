"""Question for a crowd, one row per character, and its validation column by column."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np

from posefield.common.errors import InvalidField, OutsideSamples
from posefield.common.units import Booleans, Floats, Indices, Singles
from posefield.inference import session
from posefield.inference.level_selection import MAX_COORDINATE, LevelCriteria
from posefield.kriging import random_field
from posefield.kriging.support import Support
from posefield.model_file.model_card import PERFORMER, Control, ModelCard
from posefield.motion.clip import Placement
from posefield.question.motion_question import MAX_TAKE, ExtrapolationPolicy, LabelValue, RootMode
from posefield.validation import question_validation
from posefield.validation.question_validation import label_weights

Value = TypeVar("Value")


@dataclass(frozen=True)
class Blending:
    """Transitions between levels: previous levels (N,) and completed shares (N,), 0 to 1."""

    levels: Indices
    shares: Floats


@dataclass(frozen=True)
class LabelColumn:
    """Labels of N characters in one label set.

    values: the distinct names or weights, None where the set is left open. index: (N,), into
    `values`.
    """

    values: tuple[LabelValue | None, ...]
    index: Indices


@dataclass(frozen=True)
class CharacterTakes:
    """Takes of N characters.

    seeds (N,): 0 for the prediction. variety (N,): size of the deviations. detail (N,): whether
    details are added.
    """

    seeds: Indices
    variety: Floats
    detail: Booleans

    @property
    def columns(self) -> dict[str, Indices | Floats]:
        """Return the columns by the names of their fields in a request."""
        return {"take": self.seeds, "variety": self.variety}


@dataclass(frozen=True)
class CrowdQuestion:
    """Question for one pose of each of N characters.

    controls: (N,) by name, in their units. times: (N,), s from the start of each character's clip.
    performers: the distinct performers, None for an unseen performer. performer: (N,), index into
    `performers`. labels: of further label sets. detail: levels of detail (N,), or the view that
    chooses them. extrapolate: policy for controls without similar captured clips. blending:
    transitions between levels, None without. takes: of the characters, None for the predictions.

    Raises InvalidField, with the index of the first character at fault, for columns of different
    lengths, numbers that are not finite, and positions beyond the precision of float32.
    """

    controls: Mapping[str, Floats]
    times: Floats
    placement: Placement
    performers: tuple[str | None, ...]
    performer: Indices
    detail: Indices | LevelCriteria
    root: RootMode
    extrapolate: ExtrapolationPolicy
    blending: "Blending | None" = None
    labels: Mapping[str, LabelColumn] = field(default_factory=dict)
    takes: "CharacterTakes | None" = None

    def __post_init__(self) -> None:
        for name, column in self._columns().items():
            if len(column) != len(self):
                raise InvalidField(name, f"{len(column)} characters, expected {len(self)}")
            _check(name, column, np.isfinite(column), "a finite number")
        near = np.abs(self.placement.positions) <= MAX_COORDINATE
        _check("position", self.placement.positions, near, f"at most {MAX_COORDINATE:g} m")
        if self.blending is not None:
            shares = self.blending.shares
            _check("blend", shares, (shares >= 0.0) & (shares <= 1.0), "0 to 1")

    def __len__(self) -> int:
        return len(self.times)

    def _columns(self) -> dict[str, Floats | Indices]:
        has_criteria = isinstance(self.detail, LevelCriteria)
        levels = self.detail.previous if isinstance(self.detail, LevelCriteria) else self.detail
        blending = self.blending
        return {
            **{f"controls/{name}": values for name, values in self.controls.items()},
            "time": self.times,
            "position": self.placement.positions,
            "heading": self.placement.headings,
            "performer": self.performer,
            **{f"labels/{name}": column.index for name, column in self.labels.items()},
            **({} if levels is None else {"previous_level" if has_criteria else "level": levels}),
            **(
                {}
                if blending is None
                else {"from_level": blending.levels, "blend": blending.shares}
            ),
            **({} if self.takes is None else self.takes.columns),
        }


def check_levels(question: CrowdQuestion, count: int) -> None:
    """Raise InvalidField for the first character with a level outside 0 to count - 1."""
    if isinstance(question.detail, LevelCriteria):
        field, levels = "previous_level", question.detail.previous
    else:
        field, levels = "level", question.detail
    columns = {field: levels}
    if question.blending is not None:
        columns["from_level"] = question.blending.levels
    for name, column in columns.items():
        if column is not None:
            _check(name, column, (column >= 0) & (column < count), f"0 to {count - 1}")


def labels(question: CrowdQuestion, card: ModelCard) -> Singles:
    """Return the weights (N, p) of the characters' labels; zeros in sets that are left open.

    Raises InvalidField for the first character with an unknown name or invalid weights.
    """
    weights = np.zeros((len(question), sum(card.label_counts)), dtype=np.float32)
    if PERFORMER in question.labels and question.performers != (None,):
        raise InvalidField("performer", "given, and labels/performer too, expected one")
    for performer, rows in _distinct(question.performers, question.performer):
        weights[rows] += _checked(card, rows, performer, {})
    for name, column in question.labels.items():
        for value, rows in _distinct(column.values, column.index):
            weights[rows] += _checked(card, rows, None, {} if value is None else {name: value})
    return weights


def _distinct(values: Sequence[Value], index: Indices) -> Iterator[tuple[Value, Indices]]:
    """Yield each of distinct values with the indices of its characters."""
    for number, value in enumerate(values):
        yield value, np.flatnonzero(index == number)


def _checked(
    card: ModelCard, rows: Indices, performer: str | None, label_values: Mapping[str, LabelValue]
) -> Floats:
    """Return weights (p,); InvalidField with the first of the rows for invalid ones."""
    try:
        return label_weights(card, performer, label_values)[0]
    except InvalidField as fault:
        raise InvalidField(fault.field, fault.message, int(rows[0])) from fault


def _check(field: str, column: Floats | Indices, good: Booleans, expected: str) -> None:
    """Raise InvalidField for the first character with an entry of `good` (N, ...) that is false."""
    if not good.all():
        first = int(np.argmin(good.reshape(len(column), -1).all(axis=1)))
        raise InvalidField(field, f"{column[first].tolist()}, expected {expected}", first)


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
    question_validation.check_names(card, question.controls)
    columns = [_column(control, question) for control in card.controls]
    points = np.stack(columns, axis=1)
    supported = support.supported(points)
    pairs = zip(card.controls, columns, strict=True)
    range_texts = [_range_warning(question, *pair) for pair in pairs]
    range_texts.append(
        _gap_warning(card, support, question, points[~supported], np.flatnonzero(~supported))
    )
    warnings = tuple(filter(None, range_texts)) if question.extrapolate == "warn" else ()
    return points, supported, warnings


def _column(control: Control, question: CrowdQuestion) -> Floats:
    field = f"controls/{control.name}"
    low, high = control.minimum, control.maximum
    if control.name not in question.controls:
        raise InvalidField(
            field,
            f"missing; give numbers in {control.unit}, sampled from {low:g} to {high:g}",
        )
    values = question.controls[control.name]
    lowest, highest = question_validation.accepted_range(control)
    far = (values < lowest) | (values > highest)
    expected = f"{control.unit}, expected {lowest:g} to {highest:g} {control.unit}"
    raise_for_first(field, values, far, expected)
    return values


def _range_warning(question: CrowdQuestion, control: Control, values: Floats) -> str | None:
    """Return the warning for values of a control outside the sampled range, or None.

    Raises OutsideSamples instead where `extrapolate` is "refuse".
    """
    low, high = question_validation.sampled_range(control)
    beyond = (values < low) | (values > high)
    if not beyond.any():
        return None
    first = int(np.argmax(beyond))
    text = (
        f"{control.name} of {np.count_nonzero(beyond)} characters lies outside what was sampled, "
        f"{control.minimum:g} to {control.maximum:g} {control.unit}; "
        f"the first is character {first}, {values[first]:g} {control.unit}"
        f"{_limited_part(control, values)}"
    )
    if question.extrapolate == "refuse":
        raise OutsideSamples(f"controls/{control.name}", text, first)
    return text


def _limited_part(control: Control, values: Floats) -> str:
    """Return the part of a warning that tells at which value the farthest values act."""
    extremes = float(values.min()), float(values.max())
    acting = [session.limit_control(control, value) for value in extremes]
    limited = [
        f"{acting_value:.4g}"
        for acting_value, value in zip(acting, extremes, strict=True)
        if acting_value != value
    ]
    return f"; values further out act as {' or '.join(limited)} {control.unit}" if limited else ""


def _gap_warning(
    card: ModelCard, support: Support, question: CrowdQuestion, points: Floats, characters: Indices
) -> str | None:
    """Return the warning for unsupported points (U, d) within the sampled ranges, or None.

    characters: their indices (U,). Raises OutsideSamples instead where `extrapolate` is
    "refuse".
    """
    low, high = np.transpose(
        [question_validation.sampled_range(control) for control in card.controls]
    )
    inside = np.all((points >= low) & (points <= high), axis=1)
    if not inside.any():
        return None
    first = int(characters[inside][0])
    variance = float(support.variance(points[inside][:1])[0])
    count = f"character {first}, the first of {np.count_nonzero(inside)}, lies"
    text = question_validation.gap_warning(count, variance, support.limit)
    if question.extrapolate == "refuse":
        raise OutsideSamples("controls", text, first)
    return text


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
    takes = question.takes or none
    seeds, variety = takes.seeds, takes.variety
    outside = (seeds < 0) | (seeds > MAX_TAKE)
    raise_for_first("take", seeds.astype(float), outside, f"expected 0 to {MAX_TAKE}")
    raise_for_first("variety", variety, (variety < 0.0) | (variety > 1.0), "expected 0 to 1")
    varied = int(np.count_nonzero(seeds))
    if varied > MAX_TAKES:
        raise InvalidField("take", f"{varied} characters with takes, expected at most {MAX_TAKES}")
    if varied and not random_field.has_features(card.kriging):
        name = card.kriging.covariance
        raise InvalidField("take", f"given, but no takes can be drawn of {name} kriging")
    return CharacterTakes(seeds, variety, takes.detail & bool(card.making.detail))


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
    low, high = question_validation.duration_range(card)
    senseless = ~((durations >= low) & (durations <= high))
    if senseless.any():
        first = int(np.argmax(senseless))
        raise OutsideSamples(
            "controls", question_validation.implausible_duration(card, durations[first]), first
        )
