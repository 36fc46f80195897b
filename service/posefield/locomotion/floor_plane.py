"""Points on the floor as complex numbers z + i x: forward is real, left is imaginary.

A heading h about +Y is the factor exp(i h), so rigid motion over the floor is multiplication and
addition.
"""

from typing import Annotated

import numpy as np
import numpy.typing as npt

from posefield.common.units import UP, Floats, PerPoint, Scalars
from posefield.motion import quat

FloorVectors = npt.NDArray[np.complex128]


def project(points: Annotated[Floats, "*batch 3"]) -> Annotated[FloorVectors, "*batch"]:
    """Return the floor points (...) below points (..., 3), m."""
    return points[..., 2] + 1j * points[..., 0]


def at_height(
    points: Annotated[FloorVectors, "*#batch"], height: Scalars
) -> Annotated[Floats, "*batch 3"]:
    """Return points (..., 3), m, at a height above floor points (...)."""
    points, heights = np.broadcast_arrays(points, height)
    placed = quat.components_first(points.imag, 3)
    placed[..., 1], placed[..., 2] = heights, points.real
    return placed


def unit_vectors(headings: Annotated[Floats, "*batch"]) -> Annotated[FloorVectors, "*batch"]:
    """Return the unit vectors (...) of headings, rad."""
    return np.exp(1j * headings)


def arc_displacement(
    tangent: Annotated[FloorVectors, "*#batch"] | Scalars, turn: Scalars
) -> Annotated[FloorVectors, "*batch"]:
    """Return the displacement of a path of constant speed and constant rate of turning.

    tangent: length and direction of the path at its start. turn: change of heading, rad. This is
    the exponential map of rigid motion in the plane: a straight line for no turn, else an arc of
    the same length.
    """
    return tangent * _arc_factor(turn)


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
    turned = rotations.astype(float)
    turned[..., 0, :] = quat.mul(quat.from_axis_angle(UP, headings), turned[..., 0, :])
    return turned


def smooth(
    values: Annotated[FloorVectors, "frames"],
    deviation: float,
    sharp: bool = False,
    fixed: bool = True,
) -> Annotated[FloorVectors, "frames"]:
    """Return values (F,) averaged by a Gaussian of some frames.

    sharp: whether parabolas stay as they are. fixed: whether the first and the last value stay.
    """
    reach = min(int(np.ceil(5.0 * deviation)), len(values) - 1)
    if deviation <= 0.3 or reach < 1:
        return values
    offsets = np.arange(-reach, reach + 1)
    kernel = np.exp(-0.5 * np.square(offsets / deviation))
    kernel /= kernel.sum()
    if sharp:
        wide = np.exp(-0.25 * np.square(offsets / deviation))
        kernel = 2.0 * kernel - wide / wide.sum()
    before, after = values[reach:0:-1], values[-2 : -reach - 2 : -1]
    if fixed:
        before, after = 2.0 * values[0] - before, 2.0 * values[-1] - after
    return np.convolve(np.concatenate([before, values, after]), kernel, "valid")


Ends = tuple[Annotated[Floats, "2"] | None, Annotated[Floats, "2"] | None]
"""Slopes (2,) of a spline at its first and last knot; None for no curvature there."""


def headings(
    waypoints: Annotated[Floats, "waypoints 2"], spacing: float, per_step: int, end_slopes: Ends
) -> tuple[PerPoint, PerPoint]:
    """Return distances (K,), m, along the spline through waypoints, and its headings (K,), rad.

    waypoints: (P, 2), x and z, m. The points are `per_step` to a `spacing`, m, of the straight
    lines between the waypoints. Headings have no jumps.
    """
    knots = np.pad(np.cumsum(np.linalg.norm(np.diff(waypoints, axis=0), axis=1)), (1, 0))
    count = per_step * int(np.ceil(knots[-1] / spacing)) + 1
    points, slopes = spline(knots, waypoints, np.linspace(0.0, knots[-1], count), end_slopes)
    gone = np.pad(np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)), (1, 0))
    return gone, np.unwrap(np.angle(project(np.insert(slopes, 1, 0.0, axis=1))))


def spline(
    knots: Annotated[Floats, "knots"],
    values: Annotated[Floats, "knots 2"],
    at: PerPoint,
    end_slopes: Ends = (None, None),
) -> tuple[Annotated[Floats, "points 2"], Annotated[Floats, "points 2"]]:
    """Return the cubic spline of values (P, 2) at knots (P,): values and slopes at (S,)."""
    gaps = np.diff(knots)
    chords = np.diff(values, axis=0) / gaps[:, None]
    seconds = _second_derivatives(gaps, chords, end_slopes)
    piece = np.minimum(np.searchsorted(knots, at, side="right") - 1, len(gaps) - 1)
    gap = gaps[piece][:, None]
    b = (at - knots[piece])[:, None] / gap
    a = 1.0 - b
    before, after = seconds[piece], seconds[piece + 1]
    bulge = ((a**3 - a) * before + (b**3 - b) * after) * gap**2 / 6.0
    lean = ((1.0 - 3.0 * a**2) * before + (3.0 * b**2 - 1.0) * after) * gap / 6.0
    return a * values[piece] + b * values[piece + 1] + bulge, chords[piece] + lean


def _second_derivatives(
    gaps: Annotated[Floats, "pieces"], chords: Annotated[Floats, "pieces 2"], end_slopes: Ends
) -> Annotated[Floats, "knots 2"]:
    """Return the second derivatives at the knots.

    Slopes are continuous at the inner knots: three neighbouring second derivatives per equation. A
    given slope at an end is one more equation.
    """
    system = np.diag((np.pad(gaps, (1, 0)) + np.pad(gaps, (0, 1))) / 3.0)
    system += np.diag(gaps / 6.0, 1) + np.diag(gaps / 6.0, -1)
    sides = np.zeros((len(gaps) + 1, 2))
    sides[1:-1] = np.diff(chords, axis=0)
    if end_slopes[0] is not None:
        sides[0] = chords[0] - end_slopes[0]
    if end_slopes[1] is not None:
        sides[-1] = end_slopes[1] - chords[-1]
    curved = np.array(
        [end_slopes[0] is not None, *[True] * (len(gaps) - 1), end_slopes[1] is not None]
    )
    seconds = np.zeros_like(sides)
    seconds[curved] = np.linalg.solve(system[np.ix_(curved, curved)], sides[curved])
    return seconds
