"""Conventions of files: unit of length, up axis and body."""

from dataclasses import dataclass

from posefield.common.errors import InvalidField
from posefield.common.units import LengthUnit, UpAxis
from posefield.question.body_kind import DEFAULT_BODY, BodyKind

METRES_PER_UNIT: dict[LengthUnit, float] = {"m": 1.0, "cm": 0.01}


@dataclass(frozen=True)
class Convention:
    """Unit of length, as metres per unit, up axis, and kind of body of a file.

    Formats without a body take no notice of it. A character whose up axis is Z still faces its
    front: Y up, +Z ahead becomes Z up, -Y ahead.
    """

    metres_per_unit: float
    up: UpAxis
    body: BodyKind = DEFAULT_BODY


METRES = Convention(1.0, "y")
CENTIMETRES = Convention(0.01, "y")


def requested_convention(
    unit: LengthUnit | None, up: UpAxis | None, body: BodyKind | None, usual: Convention
) -> Convention:
    """Return the requested convention; None is the default of the format."""
    length = usual.metres_per_unit if unit is None else METRES_PER_UNIT[unit]
    return Convention(length, usual.up if up is None else up, usual.body if body is None else body)


def check_convention(found: Convention, law: Convention, name: str) -> None:
    """Raise InvalidField for a convention that a format does not allow."""
    if found.metres_per_unit != law.metres_per_unit:
        raise InvalidField(
            "unit",
            f"{found.metres_per_unit:g} m, expected {law.metres_per_unit:g} m: the law of {name}",
        )
    if found.up != law.up:
        raise InvalidField("up", f"{found.up!r}, expected {law.up!r}: the law of {name}")
