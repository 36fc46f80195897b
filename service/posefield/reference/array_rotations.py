"""Rotations of arrays of any module: quaternions w x y z, matrices and rotation vectors."""

from typing import Any

import numpy as np

from posefield.motion import quat
from posefield.robots.standing_soles import Array

TINY = 1e-18
"""Added below square roots, whose slopes are infinite at zero."""
_UNITS = np.eye(4)
PRODUCTS = quat.mul(_UNITS[:, None], _UNITS).reshape(16, 4)
"""Products of quaternions, linear in the products of their numbers."""
MATRICES = (
    quat.mul(quat.mul(_UNITS[:, None, None], _UNITS[1:]), quat.conj(_UNITS)[:, None])[..., 1:]
    .swapaxes(-1, -2)
    .reshape(16, 9)
)
"""Matrices of unit quaternions by rows, from the products of their numbers."""


def about_vertical(xp: Any, vectors: Array, angle: Array) -> Array:
    """Return vectors (E, S, ..., 3) turned by angles (E, ...), rad, about the vertical."""
    cosine, sine = xp.cos(angle)[:, None], xp.sin(angle)[:, None]
    x, y, z = (vectors[..., axis] for axis in range(3))
    return xp.stack([cosine * x - sine * y, sine * x + cosine * y, z], -1)


def bilinear(a: Array, b: Array, table: Array) -> Array:
    """Return products (..., 4) of quaternions; matrices (..., 9) of a, if b is a.

    table: PRODUCTS or MATRICES.
    """
    outer = a[..., None] * b[..., None, :]
    return outer.reshape(*outer.shape[:-2], 16) @ table


def rotation_vectors(xp: Any, turns: Array) -> Array:
    """Return the rotation vectors (..., 3), rad, of unit quaternions (..., 4)."""
    vector = turns[..., 1:]
    size = xp.sqrt(xp.sum(vector * vector, -1) + TINY)
    return vector * (2.0 * xp.arctan2(size, turns[..., 0]) / size)[..., None]
