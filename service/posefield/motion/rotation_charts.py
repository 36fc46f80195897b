"""Charts of rotations: three numbers v for a rotation, linear combinations of which are rotations.

Both charts agree with the rotation vector to first order. A quaternion is c + k s v, where s is a
fixed share and c and k depend on the length of s v alone, so that a product with a mean rotation
from the left is linear in v but for these two factors.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np

from posefield.common.units import Floats, Quaternions, Vectors
from posefield.motion import quat

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
    across = quat.cross(scaled[..., None, :], np.eye(3)).swapaxes(-1, -2)
    outer = scaled[..., :, None] * scaled[..., None, :]
    jacobian = (1.0 - squares) * np.eye(3) - 2.0 * across + 2.0 * outer
    return np.asarray(jacobian / np.square(1.0 + squares))


CHARTS: dict[ChartName, RotationChart] = {
    # The exponential map of Mukai & Kuriyama 2006, which has every number of whole turns.
    "rotation_vector": RotationChart(
        0.5, np.inf, _vector_terms, lambda angles: angles, quat.right_jacobian
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
