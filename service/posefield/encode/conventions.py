"""Formats of files, and their conventions: unit of length, up axis and body.

For Z up the whole character is rotated with the axes, including the joints' own axes, so that the
rotations of the rest pose remain the identity: (x, y, z) becomes (x, -z, y), which is exact.
Numbers other than -0 never become -0.
"""

from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from posefield.common.units import Floats, LengthUnit, Singles, UpAxis
from posefield.motion.clip import Clip
from posefield.question.motion_question import DEFAULT_BODY, BodyKind

JSON = "application/json"
ARROW = "application/vnd.apache.arrow.stream"
MSGPACK = "application/vnd.msgpack"
# No type is registered for archives of arrays; some browsers would unpack application/zip.
NPZ = "application/x-npz"


@dataclass(frozen=True)
class Format:
    """Name and media type of a format; the name is the extension of its files."""

    extension: str
    media_type: str


F = TypeVar("F", bound=Format)


def by_extension(*formats: F) -> dict[str, F]:
    """Return formats by their extensions, in the given order."""
    return {kind.extension: kind for kind in formats}


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


Coordinates = TypeVar("Coordinates", Floats, Singles)

Z_UP_ORDER = [0, 2, 1]


def convert_positions(convention: Convention, metres: Coordinates) -> Coordinates:
    """Return positions or displacements (..., 3) in the unit and axes of a file.

    metres: with Y up.
    """
    unit = convention.metres_per_unit
    return convert_directions(convention, metres if unit == 1.0 else metres / unit)


def convert_directions(convention: Convention, along: Coordinates) -> Coordinates:
    """Return directions (..., 3) in the axes of a file.

    along: with Y up.
    """
    if convention.up == "y":
        return along
    return along[..., Z_UP_ORDER] * np.array([1, -1, 1], along.dtype) + along.dtype.type(0.0)


def convert_rotations(convention: Convention, turns: Singles) -> Singles:
    """Return quaternions (..., 4), real part last, in the axes of a file.

    turns: with Y up.
    """
    if convention.up == "y":
        return turns
    return turns[..., [*Z_UP_ORDER, 3]] * np.array([1, -1, 1, 1], turns.dtype) + turns.dtype.type(
        0.0
    )


def convert_clip(convention: Convention, clip: Clip) -> Clip:
    """Return the clip, with its skeleton, in the unit and axes of a file."""
    if convention == METRES:
        return clip
    joints, turns = clip.skeleton, clip.rotations
    offsets, tips = (convert_positions(convention, o) for o in (joints.offsets, joints.tip_offsets))
    turned = np.concatenate(
        [turns[..., :1], convert_directions(convention, turns[..., 1:])], axis=-1
    )
    return replace(
        clip,
        skeleton=replace(joints, offsets=offsets, tip_offsets=tips),
        rotations=turned,
        translations=convert_positions(convention, clip.translations),
    )


def convert_box(convention: Convention, corners: Floats) -> Floats:
    """Return the lowest and highest corner (..., 2, 3) of boxes in the unit and axes of a file.

    corners: m, with Y up.
    """
    return np.sort(convert_positions(convention, corners), axis=-2)
