"""Unit quaternions w x y z over arrays (..., 4); every function broadcasts over leading axes."""

import numpy as np

from service.motion.conventions import Floats

IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])


def mul(a: Floats, b: Floats) -> Floats:
    """Product a b: the rotation b followed by a."""
    aw, ax, ay, az = np.moveaxis(a, -1, 0)
    bw, bx, by, bz = np.moveaxis(b, -1, 0)
    return np.stack(
        [
            aw * bw - ax * bx - ay * by - az * bz,
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
        ],
        axis=-1,
    )


def conj(q: Floats) -> Floats:
    """Conjugate, which is the inverse of a unit quaternion."""
    return q * np.array([1.0, -1.0, -1.0, -1.0])


def normalize(q: Floats) -> Floats:
    """Unit quaternion in the direction of q."""
    return q / np.linalg.norm(q, axis=-1, keepdims=True)


def rotate(q: Floats, v: Floats) -> Floats:
    """Vector v (..., 3) turned by q."""
    w, u = q[..., :1], q[..., 1:]
    t = 2.0 * cross(u, v)
    return v + w * t + cross(u, t)


def cross(a: Floats, b: Floats) -> Floats:
    """Vector product (..., 3), in half the time of NumPy's own, which allows for other sizes."""
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    bx, by, bz = b[..., 0], b[..., 1], b[..., 2]
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=-1)


def exp(v: Floats) -> Floats:
    """Quaternion of the rotation vector v (..., 3), in radians about its own direction."""
    half = 0.5 * np.linalg.norm(v, axis=-1, keepdims=True)
    # np.sinc is sin(pi x) / (pi x), and exact at zero.
    return np.concatenate([np.cos(half), 0.5 * np.sinc(half / np.pi) * v], axis=-1)


def log(q: Floats) -> Floats:
    """Rotation vector (..., 3) of q, of the shorter of its two turns: length at most pi."""
    q = np.where(q[..., :1] < 0, -q, q)
    sine = np.linalg.norm(q[..., 1:], axis=-1, keepdims=True)
    angle = 2.0 * np.arctan2(sine, q[..., :1])
    return np.where(sine < 1e-12, 2.0, angle / np.maximum(sine, 1e-12)) * q[..., 1:]


def slerp(a: Floats, b: Floats, t: Floats) -> Floats:
    """Rotation a fraction t (...) of the shorter way from a to b."""
    return mul(a, exp(np.asarray(t)[..., None] * log(mul(conj(a), b))))


def unroll(q: Floats) -> Floats:
    """The same rotations (frames, ..., 4) with signs chosen so that neighbours lie close."""
    dots = np.einsum("...k,...k->...", q[1:], q[:-1])
    signs = np.cumprod(np.where(dots < 0, -1.0, 1.0), axis=0, dtype=q.dtype)
    return np.concatenate([q[:1], q[1:] * signs[..., None]])


def mean(q: Floats) -> Floats:
    """Chordal mean (joints, 4) of rotations (samples, joints, 4), with w at or above zero.

    The largest eigenvector of the sum of q qᵀ: blind to the sign of each q (Markley et al. 2007).
    """
    _, vectors = np.linalg.eigh(np.einsum("njk,njl->jkl", q, q))
    top = vectors[..., -1]
    return np.where(top[..., :1] < 0, -top, top)


def twist(q: Floats, axis: Floats) -> Floats:
    """Angle (...) of the part of q that turns about the unit axis (3,), in (-pi, pi]."""
    angle = 2.0 * np.arctan2(q[..., 1:] @ axis, q[..., 0])
    return np.arctan2(np.sin(angle), np.cos(angle))


def about(axis: Floats, angle: Floats) -> Floats:
    """Quaternion of a turn by angle (...) about the unit axis (3,)."""
    half = 0.5 * np.asarray(angle)[..., None]
    return np.concatenate([np.cos(half), np.sin(half) * axis], axis=-1)


def to_matrix(q: Floats) -> Floats:
    """Rotation matrices (..., 3, 3) that turn column vectors."""
    return np.swapaxes(rotate(q[..., None, :], np.eye(3)), -1, -2)


def from_matrix(m: Floats) -> Floats:
    """Quaternions of rotation matrices (..., 3, 3), with w at or above zero.

    Of the four equivalent formulas the one with the largest divisor is taken (Shepperd 1978).
    """
    xx, yy, zz = m[..., 0, 0], m[..., 1, 1], m[..., 2, 2]
    yz, zx, xy = (m[..., i, j] - m[..., j, i] for i, j in ((2, 1), (0, 2), (1, 0)))
    YZ, ZX, XY = (m[..., i, j] + m[..., j, i] for i, j in ((2, 1), (0, 2), (1, 0)))
    rows = np.stack(
        [
            np.stack([1 + xx + yy + zz, yz, zx, xy], axis=-1),
            np.stack([yz, 1 + xx - yy - zz, XY, ZX], axis=-1),
            np.stack([zx, XY, 1 - xx + yy - zz, YZ], axis=-1),
            np.stack([xy, ZX, YZ, 1 - xx - yy + zz], axis=-1),
        ],
        axis=-2,
    )
    best = np.argmax(np.diagonal(rows, axis1=-2, axis2=-1), axis=-1)
    q = normalize(np.take_along_axis(rows, best[..., None, None], axis=-2)[..., 0, :])
    return np.where(q[..., :1] < 0, -q, q)


def from_euler(angles: Floats, axes: str) -> Floats:
    """Rotation of the angles (..., len(axes)) about moving axes, the leftmost turned first.

    `axes` holds any number of X, Y and Z: "ZYX" is the product Rz Ry Rx that BVH files mean.
    """
    q = np.broadcast_to(IDENTITY, (*angles.shape[:-1], 4))
    for index, axis in enumerate(axes):
        q = mul(q, about(np.eye(3)["XYZ".index(axis)], angles[..., index]))
    return q


def to_euler(q: Floats, axes: str) -> Floats:
    """Angles (..., 3) about three different moving axes, the middle one in [-pi/2, pi/2].

    Where the middle angle is a quarter turn the outer two act alike: the last is then zero.
    """
    i, j, k = ("XYZ".index(axis) for axis in axes)
    sign = 1.0 if (j - i) % 3 == 1 else -1.0
    m = to_matrix(q)
    middle = np.arcsin(np.clip(sign * m[..., i, k], -1.0, 1.0))
    locked = np.hypot(m[..., i, i], m[..., i, j]) < 1e-9
    first = np.arctan2(-sign * m[..., j, k], m[..., k, k])
    first = np.where(locked, np.arctan2(sign * m[..., k, j], m[..., j, j]), first)
    last = np.where(locked, 0.0, np.arctan2(-sign * m[..., i, j], m[..., i, i]))
    return np.stack([first, middle, last], axis=-1)


def right_jacobian(v: Floats) -> Floats:
    """Matrix (..., 3, 3) with exp(v + dv) = exp(v) exp(J dv) to first order."""
    angle = np.linalg.norm(v, axis=-1)[..., None, None]
    safe = np.maximum(angle, 1e-4)
    across = cross(v[..., None, :], np.eye(3)).swapaxes(-1, -2)
    first = np.where(angle < 1e-4, 0.5, (1.0 - np.cos(safe)) / safe**2)
    second = np.where(angle < 1e-4, 1.0 / 6.0, (safe - np.sin(safe)) / safe**3)
    return np.eye(3) - first * across + second * across @ across
