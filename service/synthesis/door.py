"""What a question about one character must pass, whatever is asked of it."""

from collections.abc import Mapping, Sequence

import numpy as np

from service.motion.card import Control
from service.motion.conventions import Floats
from service.motion.errors import InvalidField, OutsideSamples
from service.synthesis import limits
from service.synthesis.question import Policy


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
