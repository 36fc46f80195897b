"""What a model can be asked: questions checked once, and trusted afterwards."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from service.motion.card import Control, ModelCard
from service.motion.conventions import Floats
from service.motion.errors import InvalidField, OutsideSamples
from service.synthesis import limits
from service.synthesis.question import Policy


@dataclass(frozen=True)
class Question:
    """What has passed the door: controls, in the card's order, and performer as they were given,
    and as the graph takes them, point (1, d) and labels (1, p); a warning for each control outside
    its sampled range."""

    controls: dict[str, float]
    performer: str | None
    level: int
    point: Floats
    labels: Floats
    warnings: tuple[str, ...]
    inferred: tuple[str, ...] = ()


class Door:
    """The door of one model."""

    def __init__(self, card: ModelCard) -> None:
        self._card = card
        self._ranges = [(control.name, *limits.sampled(control)) for control in card.controls]
        self._names = {control.name for control in card.controls}
        self._nobody = labels(card.performers, None)

    def question(
        self, controls: Mapping[str, float], extrapolate: Policy, performer: str | None, level: int
    ) -> Question:
        """The question, if it has an answer.

        Raises InvalidField for a control, performer or level that cannot be used, OutsideSamples
        where `extrapolate` is "refuse" and a control lies outside its sampled range.
        """
        if not controls.keys() <= self._names:
            limits.check_names(self._card, controls)
        own = self._nobody if performer is None else labels(self._card.performers, performer)
        coarsest = len(self._card.levels) - 1
        if not 0 <= level <= coarsest:
            raise InvalidField("level", f"{level}, expected 0 to {coarsest}")
        plain = self._plain(controls)
        warnings = () if plain else self._checked(controls, extrapolate)
        # However they are put: the same question has the same bytes.
        given = {name: float(controls[name]) for name, _, _ in self._ranges}
        point = np.array([list(given.values())])
        return Question(given, performer, level, point, own, warnings)

    def _plain(self, controls: Mapping[str, float]) -> bool:
        """Whether there is nothing to say of the controls, as of nearly all that are asked for."""
        if controls.keys() != self._names:
            return False
        values = ((controls[name], low, high) for name, low, high in self._ranges)
        return all(type(value) is float and low <= value <= high for value, low, high in values)

    def _checked(self, controls: Mapping[str, float], extrapolate: Policy) -> tuple[str, ...]:
        """What to warn of."""
        values = np.array([required(control, controls) for control in self._card.controls])
        return outside(self._card.controls, values, extrapolate)


def labels(performers: tuple[str, ...], asked: str | None) -> Floats:
    """Labels (1, p) of the performer asked for: all zero for nobody that was seen."""
    if asked is not None and asked not in performers:
        raise InvalidField("performer", f"{asked!r}, expected {limits.known(performers)}")
    return np.array([[float(name == asked) for name in performers]])


def required(control: Control, controls: Mapping[str, float]) -> float:
    """Value of a control; InvalidField where there is none, or none that could be answered."""
    field = f"controls/{control.name}"
    if control.name not in controls:
        raise InvalidField(
            field,
            f"missing; give a number in {control.unit}, "
            f"sampled from {control.minimum:g} to {control.maximum:g}",
        )
    value = limits.number(field, controls[control.name])
    limits.within(field, value, *limits.reach(control), control.unit)
    return value


def outside(controls: Sequence[Control], point: Floats, extrapolate: Policy) -> tuple[str, ...]:
    """A sentence for each control whose value (d,) lies outside its sampled range; OutsideSamples
    where that is refused."""
    found = (_outside(control, value) for control, value in zip(controls, point, strict=True))
    said = tuple(filter(None, found))
    if said and extrapolate == "refuse":
        raise OutsideSamples("controls", "; ".join(said))
    return said


def _outside(control: Control, value: float) -> str | None:
    low, high = limits.sampled(control)
    if low <= value <= high:
        return None
    return (
        f"{control.name} = {value:g} {control.unit} lies outside what was sampled, "
        f"{control.minimum:g} to {control.maximum:g} {control.unit}"
    )
