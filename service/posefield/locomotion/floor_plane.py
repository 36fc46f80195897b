"""Points on the floor as complex numbers z + i x: forward is real, left is imaginary.

A heading h about +Y is the factor exp(i h), so rigid motion over the floor is multiplication and
addition.
"""

from typing import Annotated

import numpy as np
import numpy.typing as npt

from posefield.common.array_shapes import Scalars
from posefield.common.units import UP, Floats
from posefield.motion import quat

FloorVectors = npt.NDArray[np.complex128]


def project(points: Annotated[Floats, "*batch 3"]) -> Annotated[FloorVectors, "*batch"]:
    """Return the floor points (...) below points (..., 3), m."""
    return points[..., 2] + 1j * points[..., 0]


def at_height(
    places: Annotated[FloorVectors, "*#batch"], height: Scalars
) -> Annotated[Floats, "*batch 3"]:
    """Return points (..., 3), m, at a height above floor points (...)."""
    return np.stack(np.broadcast_arrays(places.imag, height, places.real), axis=-1)


def unit_vectors(headings: Annotated[Floats, "*batch"]) -> Annotated[FloorVectors, "*batch"]:
    """Return the unit vectors (...) of headings, rad."""
    return np.exp(1j * headings)


def arc_displacement(
    way: Annotated[FloorVectors, "*#batch"] | Scalars, turn: Scalars
) -> Annotated[FloorVectors, "*batch"]:
    """Return the displacement of a path of constant speed and constant rate of turning.

    way: length and direction of the path at its start. turn: change of heading, rad. This is the
    exponential map of rigid motion in the plane: a straight line for no turn, else an arc of the
    same length.
    """
    return way * _arc_factor(turn)


def inverse_arc(
    gap: Annotated[FloorVectors, "*#batch"], turn: Scalars
) -> Annotated[FloorVectors, "*batch"]:
    """Return the way whose arc covers a displacement: the inverse of `arc_displacement`.

    turn: of less than a whole turn, rad.
    """
    return gap / _arc_factor(turn)


def _arc_factor(turn: Annotated[Floats, "*batch"]) -> Annotated[FloorVectors, "*batch"]:
    # sin(h) / h is np.sinc(h / pi), and exact at zero.
    return np.exp(0.5j * turn) * np.sinc(turn / (2.0 * np.pi))


def turn_roots(
    rotations: Annotated[Floats, "*poses joints 4"], headings: Annotated[Floats, "*poses"]
) -> Annotated[Floats, "*poses joints 4"]:
    """Return rotations (..., J, 4) with the roots turned by headings (...), rad, about +Y."""
    root = quat.mul(quat.from_axis_angle(UP, headings), rotations[..., 0, :])
    return np.concatenate([root[..., None, :], rotations[..., 1:, :]], axis=-2)
