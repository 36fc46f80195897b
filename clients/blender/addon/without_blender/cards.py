"""Model card, with the entries that the panel needs."""

import json
from dataclasses import dataclass
from typing import Any

import numpy as np

from . import faults, label_choice, variation
from .label_choice import LabelSet
from .service import Service, fetch, path_of

WIDTHS = 100.0
"""Widths of its sampled range by which a control may exceed it; the service refuses more."""


@dataclass(frozen=True)
class Control:
    """One control parameter and its sampled range.

    values: the distinct sampled values if they are few, else empty.
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
        """Return the range of values that the service accepts."""
        room = WIDTHS * (self.maximum - self.minimum)
        return self.minimum - room, self.maximum + room

    @property
    def sampled(self) -> str:
        """Return the sampled range or values in words."""
        if self.values:
            return ", ".join(f"{value:g}" for value in self.values) + f" {self.unit}"
        return f"{self.minimum:g} to {self.maximum:g} {self.unit}"

    def exact(self, value: float) -> float:
        """Return the number that a slider shows.

        Sliders hold float32: 1.72 becomes 1.7200000286, and a limit becomes a value beyond it.
        """
        short = np.float32(value)
        for known in (self.minimum, self.maximum, self.default, *self.values):
            if np.float32(known) == short:
                return known
        return float(str(short))

    def holds(self, value: float) -> bool:
        """Return True for a value within the sampled range."""
        return self.minimum <= value <= self.maximum


@dataclass(frozen=True)
class Card:
    """A model: its controls, joints and other settings.

    identity: name@hash, for which responses never change. parents: of each joint by name. tips: end
    point (3,) of some joints, m, Y up. rate: frames per second. errors: of each level of detail,
    root mean square, m. labels: label sets, such as performer and style. detail: True if there are
    details to sample. feet: True if feet can be asked to stand. why_no_stances: why they do not
    stand unless asked; empty if they do.
    """

    identity: str
    name: str
    description: str
    controls: tuple[Control, ...]
    parents: dict[str, str | None]
    tips: dict[str, tuple[float, float, float]]
    cyclic: bool
    rate: float
    labels: tuple[LabelSet, ...]
    errors: tuple[float, ...]
    detail: bool = False
    feet: bool = False
    why_no_stances: str = ""

    @property
    def defaults(self) -> dict[str, float]:
        """Return the default of each control by name."""
        return {control.name: control.default for control in self.controls}

    def warnings(self, values: dict[str, float]) -> list[str]:
        """Return one sentence per control outside the sampled range."""
        return [
            f"{control.name} is {values[control.name]:g}, sampled: {control.sampled}"
            for control in self.controls
            if not control.holds(values[control.name])
        ]


def get(service: Service, name: str) -> Card:
    """Return the card of a model; Unintelligible names a missing entry."""
    return decode(fetch(service, path_of(name)))


def decode(content: bytes) -> Card:
    """Return the card of its JSON text; Unintelligible names a missing entry."""
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
        labels=label_choice.of_card(plain),
        errors=tuple(float(level["rms"]) for level in plain["levels"]),
        # Services older than 3.3.0 have no details, and their cards may lack these entries.
        detail="detail" in plain.get("diagnostics", {}),
        feet=bool(plain.get("feet")) and plain.get("root") != "in_place",
        why_no_stances=variation.why_no_stances(plain),
    )


def parents_by_name(names: list[str], parents: list[int]) -> dict[str, str | None]:
    """Return each joint's parent, None for the root; parents come first."""
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
