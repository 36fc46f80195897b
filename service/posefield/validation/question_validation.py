"""Validation of questions for one character: controls, labels, performer, level and policy.

The limits of a model's inputs are shared with questions for crowds.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal

import numpy as np

from posefield.common.errors import InvalidField, OutsideSamples, did_you_mean, similar_name
from posefield.common.units import Floats
from posefield.inference import session
from posefield.kriging import support
from posefield.model_file.model_card import PERFORMER, Control, LabelSet, ModelCard
from posefield.question import motion_question
from posefield.question.motion_question import (
    ExtrapolationPolicy,
    FileQuestion,
    LabelValue,
    PoseQuestion,
    check_number,
)
from posefield.question.results import Deviation
from posefield.question.text_decoding import parameters
from posefield.validation.imputation import ControlImputer

# A clip this many times longer or shorter than any captured one is no plausible motion.
DURATION_FACTOR = 10.0


def check_names(card: ModelCard, names: Iterable[str]) -> None:
    """Raise InvalidField for the first name that is not a control of the model."""
    for name in names:
        if card.control(name) is None:
            known_names = [c.name for c in card.controls]
            hint = did_you_mean(name, known_names) or _option_hint(name)
            raise InvalidField(
                f"controls/{name}",
                f"no such control{hint}; this model has {', '.join(known_names)}",
            )


def _option_hint(name: str) -> str:
    """Return the text about an option that is similar to a name, or "".

    In a query string each name that is no option is taken for a control.
    """
    forms = (PoseQuestion, FileQuestion)
    similar = similar_name(name, [word for form in forms for word in parameters(form)])
    return "" if similar is None else f" (did you mean the option {similar!r}?)"


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


ROUNDING = 1e-6
"""Excess of a sum of weights over one that is the rounding of clients."""


def label_weights(
    card: ModelCard, performer: str | None, values: Mapping[str, LabelValue]
) -> Floats:
    """Return the weights (1, p) of the names of all label sets, for the graph.

    Those of a set are zero if it is left open. performer: short for the name in the label set
    `performer`. values: name or weights by label set. Raises InvalidField for an unknown set or
    name, for invalid weights, and for a performer given in both ways.
    """
    if performer is not None:
        if PERFORMER in values:
            raise InvalidField("performer", f"{performer!r} and labels/performer, expected one")
        check_name("performer", performer, card.performers)
    for name in values:
        _check_set(card, name)
    short = {} if performer is None else {PERFORMER: performer}
    values_by_set: Mapping[str, LabelValue] = {**values, **short}
    rows = [_set_weights(label_set, values_by_set.get(label_set.name)) for label_set in card.labels]
    return np.array([[weight for row in rows for weight in row]], dtype=np.float64)


def check_name(field: str, name: str, names: tuple[str, ...]) -> None:
    """Raise InvalidField for a name that is not among the known ones of its label set."""
    if name not in names:
        expected = "expected "
        expected += f"one of {', '.join(names)}" if names else "none: this model knows none"
        raise InvalidField(field, f"{name!r}{did_you_mean(name, names)}, {expected}")


def _check_set(card: ModelCard, name: str) -> None:
    set_names = tuple(label_set.name for label_set in card.labels)
    if name not in set_names:
        detail = f"{name!r}{did_you_mean(name, set_names)}"
        expected = (
            f"one of the label sets {', '.join(set_names)}"
            if set_names
            else "none: this model has none"
        )
        raise InvalidField(f"labels/{name}", f"{detail}, expected {expected}")


def _set_weights(label_set: LabelSet, value: LabelValue | None) -> list[float]:
    """Return the weight of each name of a set; zeros for None."""
    if value is None:
        return [0.0] * len(label_set.names)
    field = f"labels/{label_set.name}"
    if isinstance(value, str):
        check_name(field, value, label_set.names)
        return [float(name == value) for name in label_set.names]
    for name, weight in value.items():
        check_name(field, name, label_set.names)
        if check_number(f"{field}/{name}", weight) < 0.0:
            raise InvalidField(f"{field}/{name}", f"{weight:g}, expected a weight of 0 to 1")
    total = sum(value.values())
    if not 0.0 < total <= 1.0 + ROUNDING:
        raise InvalidField(
            field,
            f"weights with a sum of {total:.6g}, expected one above 0 and at most 1; what is left "
            "to 1 stays open",
        )
    return [float(value.get(name, 0.0)) for name in label_set.names]


DEVIATION_SHARE = 1e-3
"""Share of a control's range by which it may act at another value without a word: a slider that
ends at the limit rounds its value.
"""


@dataclass(frozen=True)
class ValidatedQuestion:
    """A validated question.

    controls: all controls in the card's order. performer: name, None for an unseen performer.
    named_labels: requested labels besides the performer, by label set. point: the controls as the
    graph's input, (1, d). labels: the weights of all labels as the graph's input, (1, p). warnings:
    of extrapolation. supported: true if similar clips were captured. inferred: names of the
    controls that were not given and were chosen. deviations: controls that act at another value
    than the requested one, which is too far outside the samples.
    """

    controls: dict[str, float]
    performer: str | None
    level: int
    point: Floats
    labels: Floats
    warnings: tuple[str, ...]
    supported: bool
    inferred: tuple[str, ...] = ()
    deviations: tuple[Deviation, ...] = ()
    named_labels: Mapping[str, LabelValue] = field(default_factory=dict)


class QuestionValidator:
    """Validation of the questions to one model."""

    def __init__(self, card: ModelCard) -> None:
        self._card = card
        self._ranges = [(control.name, *sampled_range(control)) for control in card.controls]
        self._names = {control.name for control in card.controls}
        self._open_labels = label_weights(card, None, {})
        self.support = support.fit_support(np.array(card.examples))

    def question(
        self,
        controls: Mapping[str, float],
        extrapolate: ExtrapolationPolicy,
        performer: str | None,
        level: int,
        label_values: Mapping[str, LabelValue] | None = None,
    ) -> ValidatedQuestion:
        """Return the validated question; controls that are not given are the conditional mean.

        The mean is conditional on the given controls and labels; label_values: labels besides the
        performer. Raises InvalidField for a control, label or level that cannot be used, and
        OutsideSamples where `extrapolate` is "refuse" and no similar clips were captured.
        """
        if not controls.keys() <= self._names:
            check_names(self._card, controls)
        label_values = label_values or {}
        if performer is None and not label_values:
            labels = self._open_labels
        else:
            labels = label_weights(self._card, performer, label_values)
        coarsest = len(self._card.levels) - 1
        if not 0 <= level <= coarsest:
            raise InvalidField("level", f"{level}, expected 0 to {coarsest}")
        plain = self._is_within_ranges(controls)
        complete = controls
        if not plain:
            complete = {
                control.name: check_control(control, controls[control.name])
                for control in self._card.controls
                if control.name in controls
            }
            if len(complete) < len(self._names):
                complete = self.imputer.impute(complete, labels)
        # Equal questions have equal bytes: controls in the card's order, and 0 for -0.
        values = {name: float(complete[name]) + 0.0 for name, _, _ in self._ranges}
        point = list(values.values())
        outside = tuple(
            f"{name} = {value:g} {control.unit} lies outside what was sampled, "
            f"{control.minimum:g} to {control.maximum:g} {control.unit}"
            for control, (name, low, high), value in zip(
                self._card.controls, self._ranges, point, strict=True
            )
            if not low <= value <= high
        )
        supported = self.support.is_supported(point)
        warnings = (
            ()
            if supported and not outside
            else self._extrapolation_warnings(extrapolate, outside, point)
        )
        inferred = () if plain else tuple(name for name in values if name not in controls)
        array = np.array([point])
        limited = () if plain else limited_controls(self._card.controls, point)
        return ValidatedQuestion(
            values,
            performer,
            level,
            array,
            labels,
            warnings,
            supported,
            inferred,
            limited,
            label_values,
        )

    def _is_within_ranges(self, controls: Mapping[str, float]) -> bool:
        """Return whether all controls are floats within the sampled ranges: the fast path."""
        if controls.keys() != self._names:
            return False
        for name, low, high in self._ranges:
            value = controls[name]
            if type(value) is not float or not low <= value <= high:
                return False
        return True

    @cached_property
    def imputer(self) -> ControlImputer:
        """Conditional means for controls that are not given."""
        return ControlImputer(self._card)

    def _extrapolation_warnings(
        self, extrapolate: ExtrapolationPolicy, outside: tuple[str, ...], point: Sequence[float]
    ) -> tuple[str, ...]:
        """Return warnings for controls outside the sampled ranges or in a gap between samples.

        outside: warnings for the ranges. Raises OutsideSamples where `extrapolate` is "refuse".
        """
        warnings = outside or (self._gap_warning(point),)
        if extrapolate == "refuse":
            raise OutsideSamples("controls", "; ".join(warnings))
        return warnings if extrapolate == "warn" else ()

    def _gap_warning(self, point: Sequence[float]) -> str:
        variance = float(self.support.variance(np.array([point]))[0])
        return gap_warning("these controls lie", variance, self.support.limit)


def check_control(control: Control, number: float) -> float:
    """Return the value of a control; InvalidField if it is not a number or out of range."""
    field = f"controls/{control.name}"
    value = motion_question.check_number(field, number)
    motion_question.check_range(field, value, *accepted_range(control), control.unit)
    return value


def limited_controls(controls: Sequence[Control], point: Sequence[float]) -> tuple[Deviation, ...]:
    """Return a deviation for each control that acts at another value than the given one.

    point: values (d,) in the order of the controls.
    """
    deviations = []
    for control, value in zip(controls, point, strict=True):
        acting = session.limit_control(control, value)
        if abs(acting - value) > DEVIATION_SHARE * (control.maximum - control.minimum):
            deviations.append(deviation(control, value, acting))
    return tuple(deviations)


def merge_warnings(
    warnings: Sequence[str], deviations: Sequence[Deviation], extrapolate: ExtrapolationPolicy
) -> tuple[str, ...]:
    """Return the warnings of a question with those of deviations, one for each control.

    A deviation tells the sampled range, too, so it replaces the warning for it.
    """
    if extrapolate == "ok":
        return tuple(warnings)
    sentences = {f"{change.control} =": change.sentence for change in deviations}
    # A range warning begins with the control's name, an equals sign and the value.
    merged = [sentences.pop(" ".join(text.split()[:2]), text) for text in warnings]
    return (*merged, *sentences.values())


def deviation(control: Control, requested: float, acting: float) -> Deviation:
    """Return the deviation of a control's given value from the requested one."""
    captured = control.minimum, control.maximum
    side: Literal["above", "below"] = "above" if acting > requested else "below"
    return Deviation(control.name, requested, acting, control.unit, captured, side)


def gap_warning(subject: str, variance: float, limit: float) -> str:
    """Return the warning for controls in a gap between the captured clips.

    subject: of the sentence. variance, limit: kriging variance there, and its largest value
    with support.
    """
    return (
        f"{subject} in a gap of what was sampled: nothing like it was captured "
        f"(variance {variance:.2g}, expected at most {limit:.2g})"
    )
