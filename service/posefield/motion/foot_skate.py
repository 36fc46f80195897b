"""Foot skate: sliding of planted feet."""

from typing import Annotated

import numpy as np

from posefield.common.units import UP, Floats

# A foot within this of its lowest is on the ground, m.
PLANTED_HEIGHT = 0.02


def mean_skate_speed(
    feet: Annotated[Floats, "*clips frames feet 3"], rate: float
) -> Annotated[Floats, "*clips"]:
    """Return the mean horizontal speed (...) of planted feet (..., F, K, 3), m/s.

    feet: positions, m. rate: frames a second. A foot is planted while it is within 2 cm of the
    lowest height that it has in the motion. Zero if no foot is planted for two frames in a row.
    """
    heights = feet @ UP
    down = heights < heights.min(axis=-2, keepdims=True) + PLANTED_HEIGHT
    planted = down[..., 1:, :] & down[..., :-1, :]
    speeds = rate * np.linalg.norm(np.diff(feet, axis=-3) * (1.0 - UP), axis=-1)
    return np.sum(speeds * planted, axis=(-2, -1)) / np.maximum(planted.sum(axis=(-2, -1)), 1)
