"""What a file calls joints, and what it measures them in; every format has a usual way."""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from service.motion.clip import Clip
from service.motion.conventions import Floats
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


def applied(clip: Clip, convention: Convention) -> Clip:
    """The clip in the convention's unit and axes, which its skeleton at rest has as well.

    The basis of every offset and local rotation is turned, so that who has no rotations at all
    still stands upright.
    """
    if convention == METRES:
        return clip
    joints, scale = clip.skeleton, 1.0 / convention.metres_per_unit
    return Clip(
        replace(
            joints,
            offsets=scale * _turned(joints.offsets, convention.up),
            tip_offsets=scale * _turned(joints.tip_offsets, convention.up),
        ),
        _about(clip.rotations, convention.up),
        scale * _turned(clip.translations, convention.up),
        clip.rate,
    )


def _about(rotations: Floats, up: Up) -> Floats:
    """Quaternions (..., 4) whose axes are turned like vectors."""
    if up == "y":
        return rotations
    return np.concatenate([rotations[..., :1], _turned(rotations[..., 1:], up)], axis=-1)


def _turned(vectors: Floats, up: Up) -> Floats:
    """Vectors (..., 3) of a frame with Y up in one whose up axis is the one given."""
    return vectors if up == "y" else vectors[..., [0, 2, 1]] * np.array([1.0, -1.0, 1.0])
