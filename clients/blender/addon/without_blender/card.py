"""Model card, with the entries that the panel needs."""

import json
import math
import struct
import urllib.parse
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from .service import Fault, Service


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
    def sampled(self) -> str:
        """Return the sampled range or values in words."""
        if self.values:
            return ", ".join(f"{value:g}" for value in self.values) + f" {self.unit}"
        return f"{self.minimum:g} to {self.maximum:g} {self.unit}"

    def exact(self, value: float) -> float:
        """Return the number that a slider shows.

        Sliders hold float32: 1.72 becomes 1.7200000286, and a limit becomes a value beyond it.
        """
        for known in (self.minimum, self.maximum, self.default, *self.values):
            if single(known) == single(value):
                return known
        return shortest(value)


@dataclass(frozen=True)
class Card:
    """A model: its controls and other settings.

    identity: name@hash, for which responses never change. labels: names by label set, such as
    performer and style. errors: of each level of detail, root mean square, m. cyclic: its clips are
    cycles. walks: it can make walking crowds.
    """

    identity: str
    controls: tuple[Control, ...]
    labels: Mapping[str, tuple[str, ...]]
    errors: tuple[float, ...]
    cyclic: bool
    walks: bool

    @property
    def name(self) -> str:
        """Return the name under which the service has the model."""
        return self.identity.partition("@")[0]

    def outside(self, values: Mapping[str, float]) -> list[str]:
        """Return one sentence per control outside the sampled range."""
        return [
            f"{control.name} is {values[control.name]:g}, sampled: {control.sampled}"
            for control in self.controls
            if not control.minimum <= values[control.name] <= control.maximum
        ]


def models(service: Service) -> tuple[tuple[str, str], ...]:
    """Return name and description of each model; raise Fault for another service."""
    service.check_version()
    listed = service.fetch("/v1/models").document
    try:
        return tuple((str(each["name"]), str(each["description"])) for each in listed["models"])
    except (KeyError, TypeError) as fault:
        raise Fault(f"the list of models is not as expected: {fault!r}") from fault


def fetch(service: Service, name: str) -> Card:
    """Return the card of a model; raise Fault for a missing entry."""
    plain = service.fetch(path(name)).document
    try:
        return Card(
            identity=str(plain["identity"]),
            controls=tuple(map(_control, plain["controls"])),
            labels={str(each["name"]): tuple(each["names"]) for each in plain["labels"]},
            errors=tuple(float(level["rms"]) for level in plain["levels"]),
            cyclic=bool(plain["cyclic"]),
            walks=bool(plain["cyclic"]) and plain["root"] == "travelling",
        )
    except (KeyError, TypeError, ValueError) as fault:
        raise Fault(f"the model's card is not as expected: {fault!r}") from fault


def path(model: str) -> str:
    """Return the path of a model, with its name quoted."""
    return "/v1/models/" + urllib.parse.quote(model, safe="@")


def values_of_json(text: str, known: Mapping[str, Any], kind: str) -> dict[str, Any]:
    """Return values by name, of a JSON object; raise Fault for other text and unknown names.

    kind: of the names, for messages.
    """
    given = json_object(text or "{}", f"{kind}s")
    for name, value in given.items():
        if name not in known:
            raise Fault(f"no {kind} is named {name}; there are {', '.join(known) or 'none'}")
        if isinstance(value, float) and not math.isfinite(value):
            raise Fault(f"{kind} {name} is {value}, expected a finite number")
    return given


def json_object(text: str, name: str) -> dict[str, Any]:
    """Return the object of a JSON text; raise Fault, which names the text, for any other."""
    try:
        found = json.loads(text)
    except (ValueError, RecursionError) as fault:
        raise Fault(f"{name}: {fault}; expected a JSON object") from fault
    if not isinstance(found, dict):
        raise Fault(f"{name}: a {type(found).__name__}, expected a JSON object")
    return found


def single(value: float) -> float:
    """Return the nearest float32."""
    return float(struct.unpack("f", struct.pack("f", value))[0])


def shortest(value: float) -> float:
    """Return the shortest decimal number of a float32 value: 29.97, not 29.9699993."""
    known = (float(f"{value:.{digits}g}") for digits in range(1, 10))
    return next((short for short in known if single(short) == single(value)), value)


def _control(plain: Mapping[str, Any]) -> Control:
    return Control(
        name=str(plain["name"]),
        unit=str(plain["unit"]),
        description=str(plain["description"]),
        minimum=float(plain["minimum"]),
        maximum=float(plain["maximum"]),
        default=float(plain["default"]),
        values=tuple(map(float, plain["values"])),
    )
