"""What a model can be asked: questions checked once, and trusted afterwards."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from service.motion import support
from service.motion.card import Control, ModelCard
from service.motion.conventions import Floats
from service.motion.errors import InvalidField, OutsideSamples
from service.synthesis import limits
from service.synthesis.question import Policy
from service.synthesis.typical import Chooser


@dataclass(frozen=True)
class Question:
    """What has passed the door: all controls, in the card's order, and performer as they were
    given, and as the graph takes them, point (1, d) and labels (1, p); what is warned of; whether
    anything like these controls was captured. inferred: names of the controls that were not given,
    and are the most typical for those that were."""

    controls: dict[str, float]
    performer: str | None
    level: int
    point: Floats
    labels: Floats
    warnings: tuple[str, ...]
    supported: bool
    inferred: tuple[str, ...] = ()


class Door:
    """The door of one model."""

    def __init__(self, card: ModelCard) -> None:
        self._card = card
        self._ranges = [(control.name, *limits.sampled(control)) for control in card.controls]
        self._names = {control.name for control in card.controls}
        self._nobody = labels(card.performers, None)
        self.support = support.of(np.array(card.examples))

    def question(
        self, controls: Mapping[str, float], extrapolate: Policy, performer: str | None, level: int
    ) -> Question:
        """The question, if it has an answer. Controls that are not given are the most typical for
        those that are, and for the performer.

        Raises InvalidField for a control, performer or level that cannot be used, OutsideSamples
        where `extrapolate` is "refuse" and nothing like the controls was captured.
        """
        if not controls.keys() <= self._names:
            limits.check_names(self._card, controls)
        own = self._nobody if performer is None else labels(self._card.performers, performer)
        coarsest = len(self._card.levels) - 1
        if not 0 <= level <= coarsest:
            raise InvalidField("level", f"{level}, expected 0 to {coarsest}")
        plain = self._plain(controls)
        every = controls if plain else self._every(controls, own)
        # However they are put: the same question has the same bytes.
        given = {name: float(every[name]) for name, _, _ in self._ranges}
        point = list(given.values())
        found = () if plain else outside(self._card.controls, point)
        supported = self.support.held(point)
        warnings = () if supported and not found else self._said(extrapolate, found, point)
        inferred = tuple(name for name in given if name not in controls)
        array = np.array([point])
        return Question(given, performer, level, array, own, warnings, supported, inferred)

    def _plain(self, controls: Mapping[str, float]) -> bool:
        """Whether there is nothing to say of the controls, as of nearly all that are asked for."""
        if controls.keys() != self._names:
            return False
        values = ((controls[name], low, high) for name, low, high in self._ranges)
        return all(type(value) is float and low <= value <= high for value, low, high in values)

    def _every(self, controls: Mapping[str, float], own: Floats) -> Mapping[str, float]:
        """All controls, as they were given or as is typical."""
        given = {
            control.name: checked(control, controls[control.name])
            for control in self._card.controls
            if control.name in controls
        }
        return given if len(given) == len(self._names) else self.chooser.fill(given, own)

    @cached_property
    def chooser(self) -> Chooser:
        """What chooses controls that are not given."""
        return Chooser(self._card)

    def _said(
        self, extrapolate: Policy, found: tuple[str, ...], point: Sequence[float]
    ) -> tuple[str, ...]:
        """What to warn of where something lies outside, or in a gap; OutsideSamples where that is
        refused."""
        said = found or (self._gap(point),)
        if extrapolate == "refuse":
            raise OutsideSamples("controls", "; ".join(said))
        return said if extrapolate == "warn" else ()

    def _gap(self, point: Sequence[float]) -> str:
        variance = float(self.support.variance(np.array([point]))[0])
        return gap("these controls lie", variance, self.support.limit)


def labels(performers: tuple[str, ...], asked: str | None) -> Floats:
    """Labels (1, p) of the performer asked for: all zero for nobody that was seen."""
    if asked is not None and asked not in performers:
        raise InvalidField("performer", f"{asked!r}, expected {limits.known(performers)}")
    return np.array([[float(name == asked) for name in performers]])


def checked(control: Control, given: float) -> float:
    """Value of a control; InvalidField for one that could not be answered."""
    field = f"controls/{control.name}"
    value = limits.number(field, given)
    limits.within(field, value, *limits.reach(control), control.unit)
    return value


def outside(controls: Sequence[Control], point: Sequence[float]) -> tuple[str, ...]:
    """A sentence for each control whose value (d,) lies outside its sampled range."""
    found = (_outside(control, value) for control, value in zip(controls, point, strict=True))
    return tuple(filter(None, found))


def gap(who: str, variance: float, limit: float) -> str:
    """What to say of controls between the captured clips, by the variance of a plain field."""
    return (
        f"{who} in a gap of what was sampled: nothing like it was captured "
        f"(variance {variance:.2g}, expected at most {limit:.2g})"
    )


def _outside(control: Control, value: float) -> str | None:
    low, high = limits.sampled(control)
    if low <= value <= high:
        return None
    return (
        f"{control.name} = {value:g} {control.unit} lies outside what was sampled, "
        f"{control.minimum:g} to {control.maximum:g} {control.unit}"
    )
