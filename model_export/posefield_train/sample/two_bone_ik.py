"""Analytic inverse kinematics of two bones."""

import numpy as np

from posefield.common.units import Floats
from posefield.motion import quat


def _direction(v: Floats) -> Floats:
    unit: Floats = v / np.linalg.norm(v, axis=-1, keepdims=True)
    return unit


def _frame(along: Floats, side: Floats) -> Floats:
    """Return orthonormal columns (..., 3, 3): along, side's part normal to it, their product."""
    first = _direction(along)
    second = _direction(side - np.sum(side * first, axis=-1, keepdims=True) * first)
    return np.stack([first, second, np.cross(first, second)], axis=-1)


def align(along: Floats, side: Floats, to_along: Floats, to_side: Floats) -> Floats:
    """Return the rotation (..., 4) of one vector onto another that keeps a second on its side.

    `along` maps to the direction of `to_along`, `side` into the half plane of `to_side`.
    """
    here, there = _frame(along, side), _frame(to_along, to_side)
    return quat.from_matrix(there @ np.swapaxes(here, -1, -2))


def knee(
    thigh: float, shin: float, hip_to_ankle: Floats, forwards: Floats
) -> tuple[Floats, Floats]:
    """Return the rotation (..., 4) of the hip and the angle (...), rad, of the knee about x.

    Both bones lie along -y at rest. hip_to_ankle, forwards: (..., 3), in the parent's frame; the
    knee bends towards `forwards`.
    """
    reach = np.sum(hip_to_ankle**2, axis=-1)
    angle = np.arccos((reach - thigh**2 - shin**2) / (2.0 * thigh * shin))
    zero = np.zeros_like(angle)
    ankle = np.stack([zero, -thigh - shin * np.cos(angle), -shin * np.sin(angle)], axis=-1)
    return align(ankle, np.array([0.0, 0.0, 1.0]), hip_to_ankle, forwards), angle


def elbow(upper: float, palm: Floats, reach: float) -> float:
    """Return the angle about y, rad, of a right elbow that puts the palm at a distance `reach`.

    upper: length of the upper arm, along -x. palm: (3,), in the forearm's frame. reach: from the
    shoulder to the palm. The palm can lie off the forearm's axis, which adds a constant angle to
    the law of cosines.
    """
    lag = np.arctan2(palm[2], -palm[0])
    level = np.hypot(palm[0], palm[2])
    cosine = (reach**2 - upper**2 - palm @ palm) / (2.0 * upper * level)
    return float(np.arccos(cosine) - lag)
