"""What a file calls joints, and what it measures them in; every format has a usual way."""

from dataclasses import dataclass
from typing import Literal

Up = Literal["y", "z"]


@dataclass(frozen=True)
class Convention:
    """How a file measures: the metres that its unit of length stands for, and the axis that is up.

    A character whose up axis is Z still faces its front: Y up, +Z ahead becomes Z up, -Y ahead.
    """

    metres_per_unit: float
    up: Up


METRES = Convention(1.0, "y")
CENTIMETRES = Convention(0.01, "y")
