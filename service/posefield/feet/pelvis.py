"""Lowering of the pelvis, so that the legs reach the places where the feet stand."""

from collections.abc import Sequence
from typing import Annotated

import numpy as np

from posefield.common.array_shapes import Frames, RootPath
from posefield.common.units import UP, Booleans, Floats
from posefield.feet import two_bone
from posefield.feet.limbs import Limb, LimbPoses

# The pelvis is lowered this long before and after it is needed, s, and its way is smoothed with a
# Gaussian that is half as wide.
SPREAD, SMOOTHING = 0.06, 0.03
# It is lowered no more than this, m.
MOST = 0.05


def need(poses: LimbPoses, leg: Limb, target: RootPath, sunk: float) -> Frames:
    """Return how much lower a leg needs the pelvis to be (F,), m; infinite out of reach.

    target: of the leg's end (F, 3), m. sunk: by how much the pelvis is lowered already, m.
    """
    apart = poses.position(leg.upper) - sunk * UP - target
    level = np.sum(np.square(apart * (1.0 - UP)), axis=-1)
    room = np.square(two_bone.firm_reach(poses, leg)) - level
    highest = np.sqrt(np.maximum(room, 0.0))
    return np.where(room < 0.0, np.inf, np.maximum(apart @ UP - highest, 0.0))


def room(poses: LimbPoses, limbs: Sequence[Limb]) -> tuple[Frames, Frames]:
    """Return how far the pelvis may be raised, and lowered (F,), m, for limbs to keep their ends.

    Both are positive, and infinite without limbs.
    """
    count = len(poses.positions)
    up, down = np.full(count, np.inf), np.full(count, np.inf)
    for limb in limbs:
        apart = poses.position(limb.upper) - poses.position(limb.lower)
        level = np.sum(np.square(apart * (1.0 - UP)), axis=-1)
        reach = np.sqrt(np.maximum(np.square(two_bone.firm_reach(poses, limb)) - level, 0.0))
        up, down = np.minimum(up, reach - apart @ UP), np.minimum(down, reach + apart @ UP)
    return np.maximum(up, 0.0), np.maximum(down, 0.0)


def lower(needs: Sequence[Frames], most: Frames, rate: float, cyclic: bool) -> Frames:
    """Return how much the pelvis is lowered (F,), m: smoothly, and at most by `most` (F,)."""
    wanted = np.minimum(np.max([np.zeros(len(most)), *needs], axis=0), most)
    smooth = cover(wanted, rate, cyclic)
    excess = cover(np.maximum(smooth - most, 0.0), rate, cyclic)
    return np.maximum(smooth - excess, 0.0)


def cover(needed: Frames, rate: float, cyclic: bool) -> Frames:
    """Return a smooth path (F,) that is nowhere below the needed one, which is not negative.

    The largest value of the neighbourhood, smoothed with a kernel that is no wider than that.
    """
    half = max(1, round(SPREAD * rate))
    if not needed.any():
        return needed
    kernel = np.exp(-0.5 * np.square(np.arange(-half, half + 1) / (SMOOTHING * rate)))
    windows = np.lib.stride_tricks.sliding_window_view
    wide = windows(_padded(needed, half, cyclic), 2 * half + 1).max(axis=-1)
    found: Frames = windows(_padded(wide, half, cyclic), 2 * half + 1) @ (kernel / kernel.sum())
    return found


def beyond(needed: Frames, most: Frames) -> Booleans:
    """Return whether a leg needs more than the pelvis can be lowered (F,)."""
    found: Booleans = needed > most + 1e-9
    return found


def _padded(values: Frames, half: int, cyclic: bool) -> Annotated[Floats, "padded"]:
    return np.pad(values, half, mode="wrap" if cyclic else "edge")
