"""What a truncation costs: numbers stored, or multiply-adds per pose."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from model_export.tensor import MotionTensor


@dataclass(frozen=True)
class Price:
    """What ranks (r1, r2, r3) cost: r1 r2 r3 of the core, so much for each rank of each mode, and
    so much for each pair of ranks of the first two modes."""

    ranks: tuple[int, int, int]
    pair: int = 0

    def of(self, r1: Any, r2: Any, r3: Any) -> Any:
        """Cost of ranks, whole numbers or arrays that broadcast against each other."""
        alone = sum(price * rank for price, rank in zip(self.ranks, (r1, r2, r3), strict=True))
        return r1 * r2 * r3 + self.pair * r1 * r2 + alone


def numbers(own_tensor: MotionTensor, controls: int) -> Price:
    """Numbers stored in the file for the motion: core, bases and kriging weights.

    A rank of the first mode is a direction of the D' degrees of freedom that vary, one of the
    second a column over the frames, one of the third a weight for every sample and every drift
    function. Not counted: what does not grow with the ranks (the means, the samples' controls, the
    fields of duration, warp and bones) and sigma's matrix.
    """
    freedoms, frames, samples = own_tensor.values.shape
    return Price((freedoms, frames, samples + controls + 1))


def operations(own_tensor: MotionTensor, controls: int) -> Price:
    """Multiply-adds of one pose, of what grows with the ranks.

    Kriging weights, core, the line between two frames, its product with the motion, and directions
    of three numbers for the root and a quaternion for each joint.
    """
    joints, samples = len(own_tensor.chart.means), own_tensor.values.shape[2]
    return Price((4 * joints + 3, 1, samples + controls + 1), pair=1)


PRICES = {"numbers": numbers, "operations": operations}


@dataclass(frozen=True)
class Compression:
    """Numbers of the raw tensor of D' × T × N over those of the core alone, and over all stored."""

    core: float
    stored: float


def compression(own_tensor: MotionTensor, ranks: Sequence[int], controls: int) -> Compression:
    """Compression at ranks (r1, r2, r3); what counts as stored says `numbers`."""
    raw = own_tensor.values.size
    stored = numbers(own_tensor, controls).of(*ranks)
    return Compression(raw / float(np.prod(ranks)), raw / float(stored))
