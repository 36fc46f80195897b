"""Accelerations of captured clips on the model card, with which joins are compared."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from posefield.common.array_shapes import Positions
from posefield.common.bounded_types import NonNegative
from posefield.common.units import Floats

RATE = 60.0
"""Frames a second at which accelerations are measured; at higher rates noise adds to them."""
USUAL = 99.0
"""Percentile of the accelerations of motions that is their usual largest one."""


@dataclass(frozen=True)
class CapturedAcceleration:
    """Accelerations in the frames of captured clips, m/s², as `mean_accelerations` at `RATE`.

    median, p99: median and 99th percentile over the frames of all clips together.
    """

    median: NonNegative
    p99: NonNegative


def mean_accelerations(positions: Positions, rate: float) -> Annotated[Floats, "inner"]:
    """Return mean accelerations (F - 2,) of joints (F, J, 3) relative to the root, m/s².

    positions: m, of frames at a rate, the root first. They are second differences; none for fewer
    than three frames.
    """
    if len(positions) < 3:
        return np.zeros(0)
    second = np.diff(positions - positions[:, :1], n=2, axis=0) * rate**2
    means: Floats = np.linalg.norm(second, axis=-1).mean(axis=-1)
    return means
