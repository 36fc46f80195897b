"""Frames a second as Blender keeps them: a whole number and what it is divided by."""

import numpy as np

NEAREST_WHOLE = 1e-6


def parts(rate: float) -> tuple[int, float]:
    """Whole number and divisor of a rate: 29.97 is 30 by 1.001001."""
    whole = max(1, round(rate))
    return whole, whole / rate


def rate(whole: int, divisor: float) -> float:
    """The rate of a scene; its divisor is a float32: 1.001, not 1.0010000467."""
    return whole / shortest(divisor)


def shortest(value: float) -> float:
    """What somebody typed of whose number a float32 is left: 29.97, not 29.9699993."""
    return float(str(np.float32(value)))


def same(one: float, other: float) -> bool:
    """Whether two rates are one within what a scene can hold."""
    return abs(one - other) <= NEAREST_WHOLE * other
