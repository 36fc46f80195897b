"""Units, axes and array types of the whole project.

Lengths are metres, times seconds, angles radians. Y is up, the frame is right-handed, a character
that faces straight ahead faces +Z. Quaternions are unit, in the order w x y z, and local to the
parent joint. Array axes run (..., frames, joints, component); leading axes are free. Other units
exist only where a file or a wire format is read or written, and the functions there have no default
for them.
"""

from typing import Literal

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
"""Arrays of numbers; float64 except for the poses that a model returns."""

Singles = npt.NDArray[np.float32]
"""Poses as a model returns them: float64 would double their memory."""

Indices = npt.NDArray[np.int64]

Booleans = npt.NDArray[np.bool_]

LengthUnit = Literal["m", "cm"]
"""Unit of length of a file."""

UpAxis = Literal["y", "z"]
"""Up axis of a file."""

UP = np.array([0.0, 1.0, 0.0])

MICROMETRES = 6
"""Decimals of metres to which numbers of answers are rounded, and distances compared, so that
machines whose last digits differ agree."""


def round_micrometres(value: float) -> float:
    """Return a number of an answer, such as a length, m, rounded to six decimals."""
    return round(float(value), MICROMETRES)
