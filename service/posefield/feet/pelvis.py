"""Lowering of the pelvis, so that the legs reach the places where the feet stand."""

import numpy as np

from posefield.common.array_shapes import Frames, RootPath
from posefield.common.units import UP

# The pelvis is lowered this long before and after it is needed, s, and its way is smoothed with a
# Gaussian that is half as wide.
SPREAD, SMOOTHING = 0.06, 0.03
# It is lowered no more than this, m.
MOST = 0.08


def need(upper: RootPath, target: RootPath, firm: Frames) -> Frames:
    """Return how much lower the upper joint must be to reach its target (F,), m.

    upper, target: (F, 3), m. firm: largest distance (F,), m. Infinite where no height is enough.
    """
    apart = upper - target
    level = np.sum(np.square(apart * (1.0 - UP)), axis=-1)
    room = np.square(firm) - level
    highest = np.sqrt(np.maximum(room, 0.0))
    return np.where(room < 0.0, np.inf, np.maximum(apart @ UP - highest, 0.0))


def smooth_cover(needed: Frames, rate: float, cyclic: bool) -> Frames:
    """Return a smooth path (F,) that is nowhere below the needed one.

    The largest of the neighbourhood, smoothed with a kernel that is no wider than that.
    """
    half = max(1, round(SPREAD * rate))
    mode = "wrap" if cyclic else "edge"
    windows = np.lib.stride_tricks.sliding_window_view
    # A short cycle is as long as its neighbourhood.
    half = min(half, (len(needed) - 1) // 2) if cyclic else half
    if not needed.any() or half < 1:
        return needed
    wide = windows(np.pad(needed, half, mode=mode), 2 * half + 1).max(axis=-1)  # type: ignore[call-overload]
    kernel = np.exp(-0.5 * np.square(np.arange(-half, half + 1) / (SMOOTHING * rate)))
    kernel /= kernel.sum()
    return np.maximum(
        windows(np.pad(wide, half, mode=mode), 2 * half + 1) @ kernel,  # type: ignore[call-overload]
        0.0,
    )


def room(upper: RootPath, target: RootPath, firm: Frames) -> Frames:
    """Return how far the upper joint may be lowered (F,), m, within reach of its target."""
    apart = upper - target
    level = np.sum(np.square(apart * (1.0 - UP)), axis=-1)
    return apart @ UP + np.sqrt(np.maximum(np.square(firm) - level, 0.0))
