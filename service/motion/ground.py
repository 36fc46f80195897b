"""Feet on the ground: how fast they slide there."""

import numpy as np

from service.motion.conventions import UP, Floats

# A foot within this of its lowest is on the ground, m.
PLANTED = 0.02


def skate(feet: Floats, rate: float) -> Floats:
    """Mean horizontal speed (...), m/s, of feet (..., F, K, 3), m, while within 2 cm of their
    lowest, at so many frames a second.

    Each motion's own heights say when that is: what the eye takes for a foot on the ground. Zero
    where no foot ever stays there for two frames.
    """
    heights = feet @ UP
    down = heights < heights.min(axis=-2, keepdims=True) + PLANTED
    planted = down[..., 1:, :] & down[..., :-1, :]
    speeds = rate * np.linalg.norm(np.diff(feet, axis=-3) * (1.0 - UP), axis=-1)
    return np.sum(speeds * planted, axis=(-2, -1)) / np.maximum(planted.sum(axis=(-2, -1)), 1)
