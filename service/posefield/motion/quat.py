"""Unit quaternions w x y z over arrays (..., 4); all functions broadcast over leading axes.

Charts give a rotation three numbers v, linear combinations of which are rotations. Both agree with
the rotation vector to first order. A quaternion is c + k s v, where s is a fixed share and c and k
depend on the length of s v alone, so that a product with a mean rotation from the left is linear in
v but for these two factors.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any, Literal

import numpy as np
import numpy.typing as npt

from posefield.common.units import Floats, JointRotations, Quaternions, Scalars, Vector, Vectors

IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])


def mul(a: Quaternions, b: Quaternions) -> Quaternions:
    """Return the product a b: the rotation b followed by a."""
    # Of a few quaternions most of the time is that of calling NumPy: these are its fastest calls.
    aw, ax, ay, az = a[..., 0], a[..., 1], a[..., 2], a[..., 3]
    bw, bx, by, bz = b[..., 0], b[..., 1], b[..., 2], b[..., 3]
    real = aw * bw - ax * bx - ay * by - az * bz
    product = components_first(real, 4)
    product[..., 1] = aw * bx + ax * bw + ay * bz - az * by
    product[..., 2] = aw * by - ax * bz + ay * bw + az * bx
    product[..., 3] = aw * bz + ax * by - ay * bx + az * bw
    return product


def components_first(
    first: Annotated[Floats, "*batch"], count: int
) -> Annotated[Floats, "*batch {count}"]:
    """Return an array (..., n) of n components, of which the first one (...) is filled in.

    Each component is contiguous in memory, which halves the time of many quaternions and vectors.
    """
    planes = np.empty((count, *first.shape), first.dtype)
    planes[0] = first
    return planes.transpose(*range(1, planes.ndim), 0)


def conj(q: Quaternions) -> Quaternions:
    """Return the conjugate, which is the inverse of a unit quaternion."""
    return q * np.array([1.0, -1.0, -1.0, -1.0])


def normalize(
    q: Annotated[Floats, "*batch components"],
) -> Annotated[Floats, "*batch components"]:
    """Return the unit quaternion, or vector, in the direction of q."""
    return q / np.linalg.norm(q, axis=-1, keepdims=True)


def rotate(q: Quaternions, v: Vectors) -> Vectors:
    """Return the vector v (..., 3) rotated by q."""
    w, u = q[..., :1], q[..., 1:]
    t = 2.0 * cross(u, v)
    return v + w * t + cross(u, t)


def cross(a: Vectors, b: Vectors) -> Vectors:
    """Return the vector product (..., 3).

    Twice as fast as numpy.cross, which also supports other sizes.
    """
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    bx, by, bz = b[..., 0], b[..., 1], b[..., 2]
    product = components_first(ay * bz - az * by, 3)
    product[..., 1] = az * bx - ax * bz
    product[..., 2] = ax * by - ay * bx
    return product


def exp(v: Vectors) -> Quaternions:
    """Return the quaternion of a rotation vector (..., 3), rad."""
    half = 0.5 * np.linalg.norm(v, axis=-1, keepdims=True)
    # np.sinc is sin(pi x) / (pi x), and exact at zero.
    turn = components_first(np.cos(half[..., 0]), 4)
    turn[..., 1:] = 0.5 * np.sinc(half / np.pi) * v
    return turn


def log(q: Quaternions) -> Vectors:
    """Return the rotation vector (..., 3) of q, rad, of length at most pi."""
    w, x, y, z = q[..., 0], q[..., 1], q[..., 2], q[..., 3]
    sine = np.sqrt(x * x + y * y + z * z)
    angle = 2.0 * np.arctan2(sine, np.abs(w))
    factor = np.where(sine < 1e-12, 2.0, angle / np.maximum(sine, 1e-12))
    return np.where(w < 0, -factor, factor)[..., None] * q[..., 1:]


def slerp(a: Quaternions, b: Quaternions, t: Scalars) -> Quaternions:
    """Return the rotation at a fraction t (...) of the shorter arc from a to b."""
    return mul(a, exp(np.asarray(t)[..., None] * log(mul(conj(a), b))))


def unroll(q: Annotated[Floats, "frames *joints 4"]) -> Annotated[Floats, "frames *joints 4"]:
    """Return equal rotations (frames, ..., 4) with signs such that neighbours lie close."""
    dots = np.einsum("...k,...k->...", q[1:], q[:-1])
    signs = np.cumprod(np.where(dots < 0, -1.0, 1.0), axis=0, dtype=q.dtype)
    return np.concatenate([q[:1], q[1:] * signs[..., None]])


def mean(q: Annotated[Floats, "samples joints 4"]) -> JointRotations:
    """Return the chordal mean (joints, 4) of rotations (samples, joints, 4), with w >= 0.

    The eigenvector of the largest eigenvalue of the sum of q qᵀ, which does not depend on the signs
    of the quaternions (Markley et al. 2007).
    """
    _, vectors = np.linalg.eigh(np.einsum("njk,njl->jkl", q, q))
    top = vectors[..., -1]
    return np.where(top[..., :1] < 0, -top, top)


def twist(q: Annotated[Floats, "*batch 4"], axis: Vector) -> Annotated[Floats, "*batch"]:
    """Return the angle (...) of the twist of q about the unit axis (3,), rad, in (-pi, pi]."""
    angle = 2.0 * np.arctan2(q[..., 1:] @ axis, q[..., 0])
    return np.arctan2(np.sin(angle), np.cos(angle))


def from_axis_angle(
    axis: Vector, angle: Annotated[Floats, "*batch"]
) -> Annotated[Floats, "*batch 4"]:
    """Return the quaternion of a rotation by angle (...), rad, about the unit axis (3,)."""
    half = 0.5 * np.asarray(angle)
    turn = components_first(np.cos(half), 4)
    turn[..., 1:] = np.sin(half)[..., None] * axis
    return turn


def to_matrix(q: Annotated[Floats, "*batch 4"]) -> Annotated[Floats, "*batch 3 3"]:
    """Return the rotation matrices (..., 3, 3), for column vectors."""
    return np.swapaxes(rotate(q[..., None, :], np.eye(3)), -1, -2)


def from_matrix(m: Annotated[Floats, "*batch 3 3"]) -> Annotated[Floats, "*batch 4"]:
    """Return the quaternions of rotation matrices (..., 3, 3), with w at or above zero.

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


def from_euler(
    angles: Annotated[Floats, "*batch {len(axes)}"], axes: str
) -> Annotated[Floats, "*batch 4"]:
    """Return the rotation of angles (..., len(axes)), rad, about moving axes, the leftmost first.

    axes: any number of X, Y and Z; "ZYX" is the product Rz Ry Rx of BVH files.
    """
    q = np.broadcast_to(IDENTITY, (*angles.shape[:-1], 4))
    for index, axis in enumerate(axes):
        q = mul(q, from_axis_angle(np.eye(3)["XYZ".index(axis)], angles[..., index]))
    return q


def to_euler(q: Annotated[Floats, "*batch 4"], axes: str) -> Annotated[Floats, "*batch 3"]:
    """Return the angles (..., 3), rad, about three different moving axes.

    The middle angle is in [-pi/2, pi/2]. Where it is a quarter turn the axes of the outer two
    coincide: the last angle is then zero.
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


def right_jacobian(v: Annotated[Floats, "*batch 3"]) -> Annotated[Floats, "*batch 3 3"]:
    """Return the matrix J (..., 3, 3) with exp(v + dv) = exp(v) exp(J dv) to first order."""
    angle = np.linalg.norm(v, axis=-1)[..., None, None]
    safe = np.maximum(angle, 1e-4)
    across = cross(v[..., None, :], np.eye(3)).swapaxes(-1, -2)
    first = np.where(angle < 1e-4, 0.5, (1.0 - np.cos(safe)) / safe**2)
    second = np.where(angle < 1e-4, 1.0 / 6.0, (safe - np.sin(safe)) / safe**3)
    return np.eye(3) - first * across + second * across @ across


# Quaternions as planes (4, ...), one contiguous array per component, take a third of the time of
# (..., 4) for many poses. Order of operations as above, so that results are bitwise equal.
def product_planes(
    a: Annotated[Floats, "4 *#batch"],
    b: Annotated[Floats, "4 *#batch"],
    out: Annotated[Floats, "4 *batch"],
) -> None:
    """Write the products a b (4, ...), rotations b followed by a, to `out`."""
    aw, ax, ay, az = a
    bw, bx, by, bz = b
    np.subtract(aw * bw - ax * bx - ay * by, az * bz, out=out[0, ...])
    np.subtract(aw * bx + ax * bw + ay * bz, az * by, out=out[1, ...])
    np.add(aw * by - ax * bz + ay * bw, az * bx, out=out[2, ...])
    np.add(aw * bz + ax * by - ay * bx, az * bw, out=out[3, ...])


def rotate_planes(
    q: Annotated[Floats, "4 *#batch"],
    v: Annotated[Floats, "3 *#batch"],
    out: Annotated[Floats, "3 *batch"],
) -> None:
    """Write vectors v (3, ...) turned by q (4, ...) to `out`."""
    w, ux, uy, uz = q
    vx, vy, vz = v
    tx = 2.0 * (uy * vz - uz * vy)
    ty = 2.0 * (uz * vx - ux * vz)
    tz = 2.0 * (ux * vy - uy * vx)
    np.add(vx + w * tx, uy * tz - uz * ty, out=out[0, ...])
    np.add(vy + w * ty, uz * tx - ux * tz, out=out[1, ...])
    np.add(vz + w * tz, ux * ty - uy * tx, out=out[2, ...])


Numbers = npt.NDArray[Any]
"""Array of any precision; results have the precision of the arguments."""


def interpolate_rows(
    rows: Annotated[Floats, "frames values"], indices: Annotated[Floats, "*places"]
) -> Annotated[Floats, "*places values"]:
    """Return rows (F, k) interpolated linearly at fractional indices (...) from 0 to F - 1.

    Shape of the result: (..., k).
    """
    before = np.minimum(indices.astype(np.int64), len(rows) - 2)
    share = (indices - before)[..., None]
    return (1.0 - share) * rows[before] + share * rows[before + 1]


def lerp(
    before: Annotated[Numbers, "rows *values"],
    after: Annotated[Numbers, "rows *values"],
    shares: Annotated[Numbers, "rows"],
) -> Annotated[Numbers, "rows *values"]:
    """Return linear interpolations (N, ...) from `before` to `after` by shares (N,), 0 to 1."""
    weights = shares.reshape(-1, *(1 for _ in before.shape[1:]))
    return before + weights * (after - before)


def nlerp(
    before: Annotated[Numbers, "rows *values 4"],
    after: Annotated[Numbers, "rows *values 4"],
    shares: Annotated[Numbers, "rows"],
) -> Annotated[Numbers, "rows *values 4"]:
    """Return unit quaternions (N, ..., 4) interpolated by shares (N,) along the shorter arc.

    Normalised linear interpolation: for rotations a few degrees apart it differs from slerp by a
    share of 1e-4.
    """
    signs = np.where(_dot(before, after) < 0.0, -1.0, 1.0).astype(after.dtype, copy=False)
    mixed = lerp(before, signs[..., None] * after, shares)
    mixed /= np.sqrt(_dot(mixed, mixed))[..., None]
    return mixed


def _dot(a: Numbers, b: Numbers) -> Numbers:
    """Return the inner products; sums of four columns take a fifth of the time of a reduction."""
    w, x, y, z = np.moveaxis(a * b, -1, 0)
    return np.asarray(w + x + y + z)


def smoothstep(shares: Annotated[Numbers, "*batch"]) -> Annotated[Numbers, "*batch"]:
    """Return shares mapped by the smoothstep 3 s² - 2 s³, whose slope is zero at 0 and 1."""
    gentle: Numbers = shares * shares * (3.0 - 2.0 * shares)
    return gentle


ChartName = Literal["rotation_vector", "stereographic"]


@dataclass(frozen=True)
class RotationChart:
    """A chart of rotations.

    share: s. limit: largest angle, rad, that has numbers. terms: from |s v|² to the factors c and
    k. lengths: from angles to the lengths of v. right_jacobian: matrix J (..., 3, 3) at numbers v
    (..., 3) with q(v + dv) = q(v) exp(J dv) to first order.
    """

    share: float
    limit: float
    terms: Callable[[Floats], tuple[Floats, Floats]]
    lengths: Callable[[Floats], Floats]
    right_jacobian: Callable[[Floats], Floats]

    def quaternions(self, numbers: Vectors) -> Quaternions:
        """Return the quaternions (..., 4) of numbers (..., 3)."""
        scaled = self.share * numbers
        real, factor = self.terms(np.sum(np.square(scaled), axis=-1, keepdims=True))
        return np.concatenate([real, factor * scaled], axis=-1)

    def planes(self, numbers: Annotated[Floats, "3 *batch"]) -> Annotated[Floats, "4 *batch"]:
        """Return the quaternions as planes (4, ...) of numbers (3, ...).

        For many poses they take a third of the time of `quaternions`.
        """
        scaled = self.share * numbers
        planes = np.empty((4, *scaled.shape[1:]))
        real, factor = self.terms(np.sum(np.square(scaled), axis=0))
        planes[0, ...] = real
        np.multiply(factor, scaled, out=planes[1:])
        return planes

    def numbers(self, vectors: Vectors) -> Vectors:
        """Return the numbers (..., 3) of rotation vectors (..., 3), rad, shorter than `limit`."""
        angles = np.linalg.norm(vectors, axis=-1, keepdims=True)
        safe = np.maximum(angles, SMALL_ANGLE)
        return vectors * (self.lengths(safe) / safe)


SMALL_ANGLE = 1e-6
"""Angle, rad, below which all charts are the rotation vector, up to rounding."""


def _vector_terms(squares: Floats) -> tuple[Floats, Floats]:
    """Return cos a and sin a / a of half angles a, from their squares."""
    half = np.sqrt(squares)
    # np.sinc is sin(pi x) / (pi x), and exact at zero.
    return np.cos(half), np.sinc(half / np.pi)


def _stereographic_terms(squares: Floats) -> tuple[Floats, Floats]:
    factor = 2.0 / (1.0 + squares)
    return factor - 1.0, factor


def _stereographic_jacobian(numbers: Vectors) -> Annotated[Floats, "*batch 3 3"]:
    """Return the right Jacobian of the stereographic chart (Schaub & Junkins 1996, eq. 24)."""
    scaled = 0.25 * numbers
    squares = np.sum(np.square(scaled), axis=-1)[..., None, None]
    across = cross(scaled[..., None, :], np.eye(3)).swapaxes(-1, -2)
    outer = scaled[..., :, None] * scaled[..., None, :]
    jacobian = (1.0 - squares) * np.eye(3) - 2.0 * across + 2.0 * outer
    return np.asarray(jacobian / np.square(1.0 + squares))


CHARTS: dict[ChartName, RotationChart] = {
    # The exponential map of Mukai & Kuriyama 2006, which has every number of whole turns.
    "rotation_vector": RotationChart(
        0.5, np.inf, _vector_terms, lambda angles: angles, right_jacobian
    ),
    # Four times the tangent of a quarter of the angle, along the axis: no sine or cosine.
    "stereographic": RotationChart(
        0.25,
        1.9 * np.pi,
        _stereographic_terms,
        lambda angles: 4.0 * np.tan(0.25 * angles),
        _stereographic_jacobian,
    ),
}
"""Charts by their names in model files."""
