"""Places on the floor as complex numbers z + i x: forward is real, left is imaginary.

A heading h, which turns about +Y, is then the factor exp(i h), and rigid motion over the floor is
multiplication and addition.
"""

import numpy as np
import numpy.typing as npt

from service.motion import quat
from service.motion.conventions import UP, Floats

Plane = npt.NDArray[np.complex128]


def of(points: Floats) -> Plane:
    """Places (...) of points (..., 3), m."""
    return points[..., 2] + 1j * points[..., 0]


def at_height(places: Plane, height: Floats) -> Floats:
    """Points (..., 3), m, that stand so high over places (...)."""
    return np.stack(np.broadcast_arrays(places.imag, height, places.real), axis=-1)


def facing(headings: Floats) -> Plane:
    """Unit vectors (...) of headings, rad."""
    return np.exp(1j * headings)


def arc(way: Plane | Floats, turn: Floats) -> Plane:
    """Where one gets to who goes a way of constant speed and turns evenly by `turn`, rad.

    The exponential map of rigid motion in the plane: a straight line where nothing turns, else an
    arc whose length is that of the way.
    """
    return way * _bent(turn)


def straightened(gap: Plane, turn: Floats) -> Plane:
    """The way whose arc leads over a gap: the inverse of `arc`, for less than a whole turn."""
    return gap / _bent(turn)


def _bent(turn: Floats) -> Plane:
    # sin(h) / h is np.sinc(h / pi), and exact at zero.
    return np.exp(0.5j * turn) * np.sinc(turn / (2.0 * np.pi))


def turned(rotations: Floats, headings: Floats) -> Floats:
    """Rotations (..., J, 4) of bodies whose roots are turned on by headings (...) about +Y."""
    root = quat.mul(quat.about(UP, headings), rotations[..., 0, :])
    return np.concatenate([root[..., None, :], rotations[..., 1:, :]], axis=-2)
