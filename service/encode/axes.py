"""Places, lengths and turns in the units and axes of a file.

Where Z is up the whole character is turned with the axes, joints' own axes too, and a pose at rest
still turns none: (x, y, z) becomes (x, -z, y), which rounds nothing. Numbers that are not -0 do
not become -0.
"""

import math
from dataclasses import replace
from typing import TypeVar

import numpy as np

from service.encode.convention import METRES, Convention
from service.motion.clip import Clip
from service.motion.conventions import Floats, Singles

Either = TypeVar("Either", Floats, Singles)

TURNED = [0, 2, 1]


def places(convention: Convention, metres: Either) -> Either:
    """Places (..., 3), or ways, of metres and Y up."""
    unit = convention.metres_per_unit
    return directions(convention, metres if unit == 1.0 else metres / unit)


def directions(convention: Convention, along: Either) -> Either:
    """Directions (..., 3) of Y up."""
    if convention.up == "y":
        return along
    return along[..., TURNED] * np.array([1, -1, 1], along.dtype) + along.dtype.type(0.0)


def rotations(convention: Convention, turns: Singles) -> Singles:
    """Quaternions (..., 4), real part last, of Y up."""
    if convention.up == "y":
        return turns
    return turns[..., [*TURNED, 3]] * np.array([1, -1, 1, 1], turns.dtype) + turns.dtype.type(0.0)


def moved(convention: Convention, clip: Clip) -> Clip:
    """The clip in a file's units and axes, in which its skeleton is at rest as well."""
    if convention == METRES:
        return clip
    joints, turns = clip.skeleton, clip.rotations
    offsets, tips = (places(convention, o) for o in (joints.offsets, joints.tip_offsets))
    turned = np.concatenate([turns[..., :1], directions(convention, turns[..., 1:])], axis=-1)
    return Clip(
        replace(joints, offsets=offsets, tip_offsets=tips),
        turned,
        places(convention, clip.translations),
        clip.rate,
    )


def box(convention: Convention, corners: Floats) -> Floats:
    """Lowest and highest corner (..., 2, 3) of boxes in metres and Y up."""
    return np.sort(places(convention, corners), axis=-2)


def rounded(convention: Convention, lengths: Floats) -> Floats:
    """The nearest float32 as a short decimal, about: to a tenth of a micrometre."""
    decimals = 7 + math.floor(math.log10(convention.metres_per_unit))
    return np.round(lengths, decimals) + 0.0
