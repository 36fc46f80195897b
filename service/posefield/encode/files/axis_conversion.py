"""Conversion of positions, lengths and rotations to the unit and axes of a file.

For Z up the whole character is rotated with the axes, including the joints' own axes, so that the
rotations of the rest pose remain the identity: (x, y, z) becomes (x, -z, y), which is exact.
Numbers other than -0 never become -0.
"""

import math
from dataclasses import replace
from typing import TypeVar

import numpy as np

from posefield.common.units import Floats, Singles
from posefield.encode.files.file_convention import METRES, Convention
from posefield.motion.clip import Clip

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


def rounded_lengths(convention: Convention, lengths: Floats) -> Floats:
    """Return lengths in the unit of a file, rounded to a tenth of a micrometre.

    As decimals they are then short, and still near their float32 values.
    """
    decimals = 7 + math.floor(math.log10(convention.metres_per_unit))
    return np.round(lengths, decimals) + 0.0
