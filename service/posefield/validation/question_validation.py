"""Validation of questions for one character: controls, performer, level and policy."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from posefield.common.errors import InvalidField, OutsideSamples
from posefield.common.units import Floats
from posefield.kriging import support
from posefield.model_file import answer_bounds
from posefield.model_file.model_card import Control, ModelCard
from posefield.question import value_validation
from posefield.question.motion_question import ExtrapolationPolicy, LabelValue
from posefield.question.results import Deviation
from posefield.validation import input_limits
from posefield.validation.imputation import ControlImputer
from posefield.validation.label_validation import label_weights

DEVIATION_SHARE = 1e-3
"""Share of a control's range by which it may act at another value without a word: a slider that
ends at the limit rounds its value.
"""


@dataclass(frozen=True)
class ValidatedQuestion:
    """A validated question.

    controls: all controls in the card's order. performer: name, None for an unseen performer.
    named: requested labels besides the performer, by label set. point: the controls as the graph's
    input, (1, d). labels: the weights of all labels as the graph's input, (1, p). warnings: of
    extrapolation. supported: true if similar clips were captured. inferred: names of the controls
    that were not given and were chosen. deviations: controls that act at another value than the
    requested one, which is too far outside the samples.
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
    named: Mapping[str, LabelValue] = field(default_factory=dict)


class QuestionValidator:
    """Validation of the questions to one model."""

    def __init__(self, card: ModelCard) -> None:
        self._card = card
        self._ranges = [
            (control.name, *input_limits.sampled_range(control)) for control in card.controls
        ]
        self._names = {control.name for control in card.controls}
        self._open_labels = label_weights(card, None, {})
        self.support = support.fit_support(np.array(card.examples))

    def question(
        self,
        controls: Mapping[str, float],
        extrapolate: ExtrapolationPolicy,
        performer: str | None,
        level: int,
        named: Mapping[str, LabelValue] | None = None,
    ) -> ValidatedQuestion:
        """Return the validated question; controls that are not given are the conditional mean.

        The mean is conditional on the given controls and labels; named: labels besides the
        performer. Raises InvalidField for a control, label or level that cannot be used, and
        OutsideSamples where `extrapolate` is "refuse" and no similar clips were captured.
        """
        if not controls.keys() <= self._names:
            input_limits.check_names(self._card, controls)
        named = named or {}
        if performer is None and not named:
            own = self._open_labels
        else:
            own = label_weights(self._card, performer, named)
        coarsest = len(self._card.levels) - 1
        if not 0 <= level <= coarsest:
            raise InvalidField("level", f"{level}, expected 0 to {coarsest}")
        plain = self._is_within_ranges(controls)
        every = controls if plain else self._complete_controls(controls, own)
        # Equal questions have equal bytes: controls in the card's order, and 0 for -0.
        given = {name: float(every[name]) + 0.0 for name, _, _ in self._ranges}
        point = list(given.values())
        found = () if plain else range_warnings(self._card.controls, point)
        supported = self.support.is_supported(point)
        warnings = (
            ()
            if supported and not found
            else self._extrapolation_warnings(extrapolate, found, point)
        )
        inferred = tuple(name for name in given if name not in controls)
        array = np.array([point])
        limited = () if plain else limited_controls(self._card.controls, point)
        return ValidatedQuestion(
            given, performer, level, array, own, warnings, supported, inferred, limited, named
        )

    def _is_within_ranges(self, controls: Mapping[str, float]) -> bool:
        """Return whether all controls are floats within the sampled ranges: the fast path."""
        if controls.keys() != self._names:
            return False
        values = ((controls[name], low, high) for name, low, high in self._ranges)
        return all(type(value) is float and low <= value <= high for value, low, high in values)

    def _complete_controls(self, controls: Mapping[str, float], own: Floats) -> Mapping[str, float]:
        """Return all controls: the given ones checked, the others as conditional means."""
        given = {
            control.name: check_control(control, controls[control.name])
            for control in self._card.controls
            if control.name in controls
        }
        return given if len(given) == len(self._names) else self.imputer.impute(given, own)

    @cached_property
    def imputer(self) -> ControlImputer:
        """Conditional means for controls that are not given."""
        return ControlImputer(self._card)

    def _extrapolation_warnings(
        self, extrapolate: ExtrapolationPolicy, found: tuple[str, ...], point: Sequence[float]
    ) -> tuple[str, ...]:
        """Return warnings for controls outside the sampled ranges or in a gap between samples.

        found: warnings for the ranges. Raises OutsideSamples where `extrapolate` is "refuse".
        """
        said = found or (self._gap_warning(point),)
        if extrapolate == "refuse":
            raise OutsideSamples("controls", "; ".join(said))
        return said if extrapolate == "warn" else ()

    def _gap_warning(self, point: Sequence[float]) -> str:
        variance = float(self.support.variance(np.array([point]))[0])
        return gap_warning("these controls lie", variance, self.support.limit)


def check_control(control: Control, given: float) -> float:
    """Return the value of a control; InvalidField if it is not a number or out of range."""
    field = f"controls/{control.name}"
    value = value_validation.check_number(field, given)
    value_validation.check_range(field, value, *input_limits.accepted_range(control), control.unit)
    return value


def range_warnings(controls: Sequence[Control], point: Sequence[float]) -> tuple[str, ...]:
    """Return a warning for each control whose value is outside its sampled range.

    point: values (d,) in the order of the controls.
    """
    found = (_range_warning(control, value) for control, value in zip(controls, point, strict=True))
    return tuple(filter(None, found))


def limited_controls(controls: Sequence[Control], point: Sequence[float]) -> tuple[Deviation, ...]:
    """Return a deviation for each control that acts at another value than the given one.

    point: values (d,) in the order of the controls.
    """
    found = []
    for control, value in zip(controls, point, strict=True):
        acting = answer_bounds.limit_control(control, value)
        if abs(acting - value) > DEVIATION_SHARE * (control.maximum - control.minimum):
            found.append(deviation(control, value, acting))
    return tuple(found)


def merge_warnings(
    warnings: Sequence[str], deviations: Sequence[Deviation], extrapolate: ExtrapolationPolicy
) -> tuple[str, ...]:
    """Return the warnings of a question with those of deviations, one for each control.

    A deviation tells the sampled range, too, so it replaces the warning of `range_warnings`.
    """
    if extrapolate == "ok":
        return tuple(warnings)
    told = {f"{each.control} =": each.sentence for each in deviations}
    # A range warning begins with the control's name, an equals sign and the value.
    merged = [told.pop(" ".join(text.split()[:2]), text) for text in warnings]
    return (*merged, *told.values())


def deviation(control: Control, asked: float, given: float) -> Deviation:
    """Return the deviation of a control's given value from the requested one."""
    captured = control.minimum, control.maximum
    return Deviation(control.name, asked, given, control.unit, captured)


def gap_warning(who: str, variance: float, limit: float) -> str:
    """Return the warning for controls in a gap between the captured clips.

    who: subject of the sentence. variance, limit: kriging variance there, and its largest value
    with support.
    """
    return (
        f"{who} in a gap of what was sampled: nothing like it was captured "
        f"(variance {variance:.2g}, expected at most {limit:.2g})"
    )


def _range_warning(control: Control, value: float) -> str | None:
    low, high = input_limits.sampled_range(control)
    if low <= value <= high:
        return None
    return (
        f"{control.name} = {value:g} {control.unit} lies outside what was sampled, "
        f"{control.minimum:g} to {control.maximum:g} {control.unit}"
    )
