"""Curves: named scalar channels of a motion, such as the weights of blend shapes."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from posefield.common.bounded_types import Name, Number, Positive
from posefield.common.units import Floats


@dataclass(frozen=True)
class Curve:
    """Scalar channel of a family.

    minimum, maximum: limits of its values; answers are clamped to them. distance: m, that a joint
    would have to move for the same effect on distances between motions as a change by one.
    """

    name: Name
    minimum: Number
    maximum: Number
    distance: Positive


@dataclass(frozen=True)
class CurveValues:
    """Values (F, C) of curves in the frames of a clip."""

    curves: tuple[Curve, ...]
    values: Annotated[Floats, "frames curves"]

    @property
    def names(self) -> list[str]:
        """Return the names of the curves."""
        return [curve.name for curve in self.curves]


def clamp(
    curves: Sequence[Curve], values: Annotated[Floats, "*batch curves"]
) -> Annotated[Floats, "*batch curves"]:
    """Return values (..., C) within the limits of their curves."""
    low, high = limits(curves)
    return np.clip(values, low, high)


def limits(
    curves: Sequence[Curve],
) -> tuple[Annotated[Floats, "curves"], Annotated[Floats, "curves"]]:
    """Return the smallest and the largest value (C,) of each curve."""
    ranges = np.array([(curve.minimum, curve.maximum) for curve in curves]).reshape(-1, 2)
    return ranges[:, 0], ranges[:, 1]


def distances(curves: Sequence[Curve]) -> Annotated[Floats, "curves"]:
    """Return the distance (C,), m, that one unit of each curve counts as."""
    return np.array([curve.distance for curve in curves], dtype=np.float64)


def as_points(
    curves: Sequence[Curve], values: Annotated[Floats, "*batch curves"]
) -> Annotated[Floats, "*batch curves 3"]:
    """Return values (..., C) as points (..., C, 3), m, on a line.

    Distances between them are those that the curves count as, beside distances of joints.
    """
    points = np.zeros((*values.shape, 3))
    points[..., 0] = values * distances(curves)
    return points
