"""Conversion from the service's axes (Y up, facing +Z) to Blender's (Z up, facing -Y).

Also quaternions, w x y z in arrays (..., 4). No other module converts axes.
"""

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]


def z_up(points: Floats) -> Floats:
    """Return points (..., 3) with Z up: x, y, z becomes x, -z, y."""
    return np.stack([points[..., 0], -points[..., 2], points[..., 1]], axis=-1)


def z_up_turns(turns: Floats) -> Floats:
    """Return rotations (..., 4) with Z up: the axis is converted as points are, the angle stays."""
    return np.concatenate([turns[..., :1], z_up(turns[..., 1:])], axis=-1)


def mul(a: Floats, b: Floats) -> Floats:
    """Return the product a b: the rotation b followed by a."""
    v, w = a[..., 1:], b[..., 1:]
    scalar = a[..., :1] * b[..., :1] - (v * w).sum(axis=-1, keepdims=True)
    return np.concatenate([scalar, a[..., :1] * w + b[..., :1] * v + np.cross(v, w)], axis=-1)


def conj(turns: Floats) -> Floats:
    """Return the inverse of unit quaternions."""
    return turns * np.array([1.0, -1.0, -1.0, -1.0])


def of_matrices(matrices: Floats) -> Floats:
    """Return unit quaternions of rotation matrices (..., 3, 3), by the best-fitting eigenvector.

    Bones store float32 matrices, which are orthogonal to seven digits only (Bar-Itzhack 2000).
    """
    m = np.swapaxes(matrices, -1, -2)
    k = np.zeros((*m.shape[:-2], 4, 4))
    trace = np.trace(m, axis1=-2, axis2=-1)
    k[..., 0, 0] = trace
    skew = np.stack(
        [m[..., 1, 2] - m[..., 2, 1], m[..., 2, 0] - m[..., 0, 2], m[..., 0, 1] - m[..., 1, 0]],
        axis=-1,
    )
    k[..., 0, 1:] = k[..., 1:, 0] = skew
    k[..., 1:, 1:] = m + np.swapaxes(m, -1, -2) - trace[..., None, None] * np.eye(3)
    return np.linalg.eigh(k)[1][..., -1]


def unrolled(turns: Floats) -> Floats:
    """Return the same rotations (frames, ..., 4) with signs such that neighbours are close."""
    dots = (turns[1:] * turns[:-1]).sum(axis=-1)
    signs = np.cumprod(np.where(dots < 0, -1.0, 1.0), axis=0)
    return np.concatenate([turns[:1], turns[1:] * signs[..., None]])


def angle(turns: Floats) -> Floats:
    """Return the rotation angle of each of (..., 4), rad, at most π."""
    return 2.0 * np.arctan2(np.linalg.norm(turns[..., 1:], axis=-1), np.abs(turns[..., 0]))
