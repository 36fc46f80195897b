"""Rotations of arrays of any module: quaternions w x y z, matrices and rotation vectors."""

from typing import Any

from posefield.robots.standing_soles import Array

TINY = 1e-18
"""Added below square roots, whose slopes are infinite at zero."""


def about_vertical(xp: Any, vectors: Array, angle: Array) -> Array:
    """Return vectors (E, S, 3) turned by angles (E,), rad, about the vertical."""
    cosine, sine = xp.cos(angle)[:, None], xp.sin(angle)[:, None]
    x, y, z = (vectors[..., axis] for axis in range(3))
    return xp.stack([cosine * x - sine * y, sine * x + cosine * y, z], -1)


def product(xp: Any, a: Array, b: Array) -> Array:
    """Return the products of quaternions (..., 4)."""
    aw, ax, ay, az = (a[..., axis] for axis in range(4))
    bw, bx, by, bz = (b[..., axis] for axis in range(4))
    return xp.stack(
        [
            aw * bw - ax * bx - ay * by - az * bz,
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
        ],
        -1,
    )


def matrices(xp: Any, turns: Array) -> Array:
    """Return the matrices (..., 3, 3) of unit quaternions (..., 4)."""
    w, x, y, z = (turns[..., axis] for axis in range(4))
    rows = [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
    ]
    return xp.stack([xp.stack(row, -1) for row in rows], -2)


def rotation_vectors(xp: Any, turns: Array) -> Array:
    """Return the rotation vectors (..., 3), rad, of unit quaternions (..., 4)."""
    vector = turns[..., 1:]
    size = xp.sqrt(xp.sum(vector * vector, -1) + TINY)
    return vector * (2.0 * xp.arctan2(size, turns[..., 0]) / size)[..., None]
