"""What a file calls joints, and what it measures them in; every format has a usual way."""

from dataclasses import dataclass
from typing import Literal

from service.motion.errors import InvalidField

Up = Literal["y", "z"]
Unit = Literal["m", "cm"]

METRES_PER_UNIT: dict[Unit, float] = {"m": 1.0, "cm": 0.01}


@dataclass(frozen=True)
class Convention:
    """How a file measures: the metres that its unit of length stands for, and the axis that is up.

    A character whose up axis is Z still faces its front: Y up, +Z ahead becomes Z up, -Y ahead.
    """

    metres_per_unit: float
    up: Up


METRES = Convention(1.0, "y")
CENTIMETRES = Convention(0.01, "y")


def of(unit: Unit | None, up: Up | None, usual: Convention) -> Convention:
    """What was asked for, and as usual where nothing was."""
    length = usual.metres_per_unit if unit is None else METRES_PER_UNIT[unit]
    return Convention(length, usual.up if up is None else up)


def refuse_other(found: Convention, law: Convention, name: str) -> None:
    """InvalidField for a convention in which a format cannot be."""
    if found.metres_per_unit != law.metres_per_unit:
        raise InvalidField(
            "unit",
            f"{found.metres_per_unit:g} m, expected {law.metres_per_unit:g} m: the law of {name}",
        )
    if found.up != law.up:
        raise InvalidField("up", f"{found.up!r}, expected {law.up!r}: the law of {name}")
