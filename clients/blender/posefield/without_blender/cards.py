"""What a model says of itself, as far as a panel needs it."""

import json
from dataclasses import dataclass
from typing import Any

import numpy as np

from . import faults
from .service import Service, fetch, path_of

WIDTHS = 100.0
"""How many widths of its sampled range a control may lie beyond it: the service answers no more."""


@dataclass(frozen=True)
class Control:
    """One control parameter and what of it was sampled.

    values: the distinct sampled values where they are few, else empty.
    """

    name: str
    unit: str
    description: str
    minimum: float
    maximum: float
    default: float
    values: tuple[float, ...]

    @property
    def limits(self) -> tuple[float, float]:
        """Between what a value must lie for an answer."""
        room = WIDTHS * (self.maximum - self.minimum)
        return self.minimum - room, self.maximum + room

    @property
    def sampled(self) -> str:
        """What was sampled, in words."""
        if self.values:
            return ", ".join(f"{value:g}" for value in self.values) + f" {self.unit}"
        return f"{self.minimum:g} to {self.maximum:g} {self.unit}"

    def exact(self, value: float) -> float:
        """The number that a slider means.

        Sliders hold float32: 1.72 comes out as 1.7200000286, and a bound as a value beyond it.
        """
        short = np.float32(value)
        for known in (self.minimum, self.maximum, self.default, *self.values):
            if np.float32(known) == short:
                return known
        return float(str(short))

    def holds(self, value: float) -> bool:
        """Whether the value lies within what was sampled."""
        return self.minimum <= value <= self.maximum


@dataclass(frozen=True)
class Card:
    """A model: its controls, its joints and what else may be chosen.

    identity: name@hash, under which answers never change. tips: for some joints a point (3,) that
    they reach out to, m, Y up. errors: of each level of detail, as a root mean square, m.
    """

    identity: str
    name: str
    description: str
    controls: tuple[Control, ...]
    parents: dict[str, str | None]
    tips: dict[str, tuple[float, float, float]]
    cyclic: bool
    rate: float
    performers: tuple[str, ...]
    errors: tuple[float, ...]

    @property
    def defaults(self) -> dict[str, float]:
        """Of each control by name."""
        return {control.name: control.default for control in self.controls}

    def warnings(self, values: dict[str, float]) -> list[str]:
        """A sentence for each control outside what was sampled."""
        return [
            f"{control.name} is {values[control.name]:g}, sampled: {control.sampled}"
            for control in self.controls
            if not control.holds(values[control.name])
        ]


def get(service: Service, name: str) -> Card:
    """The card of a model; Unintelligible says what it lacks."""
    return decode(fetch(service, path_of(name)))


def decode(content: bytes) -> Card:
    """Card of its JSON text."""
    try:
        return _card(json.loads(content))
    except (ValueError, KeyError, TypeError, IndexError) as fault:
        raise faults.Unintelligible(
            f"the model's card is not as expected ({type(fault).__name__}: {fault});"
            " the service is of another version"
        ) from fault


def _card(plain: dict[str, Any]) -> Card:
    joints = plain["skeleton"]
    names = [str(name) for name in joints["names"]]
    found = zip(joints["tip_joints"], joints["tip_offsets"], strict=True)
    return Card(
        identity=str(plain["identity"]),
        name=str(plain["name"]),
        description=str(plain["description"]),
        controls=tuple(_control(each) for each in plain["controls"]),
        parents=parents_by_name(names, joints["parents"]),
        tips={names[joint]: (float(x), float(y), float(z)) for joint, (x, y, z) in found},
        cyclic=bool(plain["cyclic"]),
        rate=float(plain["rate"]),
        performers=tuple(str(each) for each in plain["performers"]),
        errors=tuple(float(level["rms"]) for level in plain["levels"]),
    )


def parents_by_name(names: list[str], parents: list[int]) -> dict[str, str | None]:
    """Each joint's parent, None for the root; parents come first."""
    return {
        name: names[parent] if parent >= 0 else None
        for name, parent in zip(names, parents, strict=True)
    }


def _control(plain: dict[str, Any]) -> Control:
    return Control(
        name=str(plain["name"]),
        unit=str(plain["unit"]),
        description=str(plain["description"]),
        minimum=float(plain["minimum"]),
        maximum=float(plain["maximum"]),
        default=float(plain["default"]),
        values=tuple(float(value) for value in plain["values"]),
    )
