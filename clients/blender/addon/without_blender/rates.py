"""Frames per second as Blender stores them: an integer and a divisor."""

import numpy as np

NEAREST_WHOLE = 1e-6


def parts(rate: float) -> tuple[int, float]:
    """Return integer and divisor of a rate: 29.97 is 30 / 1.001001."""
    whole = max(1, round(rate))
    return whole, whole / rate


def rate(whole: int, divisor: float) -> float:
    """Return the rate of a scene; its divisor is a float32: 1.001, not 1.0010000467."""
    return whole / shortest(divisor)


def shortest(value: float) -> float:
    """Return the shortest decimal number of a float32 value: 29.97, not 29.9699993."""
    return float(str(np.float32(value)))


def same(one: float, other: float) -> bool:
    """Return True if two rates are equal within the precision of a scene."""
    return abs(one - other) <= NEAREST_WHOLE * other
