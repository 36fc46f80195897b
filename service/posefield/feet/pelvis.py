"""Lowering of the pelvis, so that the legs reach the places where the feet stand."""

from collections.abc import Sequence
from typing import Annotated

import numpy as np

from posefield.common.array_shapes import Frames
from posefield.common.units import UP, Booleans, Floats
from posefield.feet import two_bone
from posefield.feet.limbs import Limb, LimbPoses, Points, Values

# The pelvis is lowered this long before and after it is needed, s, and its way is smoothed with a
# Gaussian that is half as wide.
SPREAD, SMOOTHING = 0.06, 0.03
# It is lowered no more than this, m.
MOST = 0.05


def need(
    poses: LimbPoses, leg: Limb, target: Points, sunk: float | Annotated[Floats, "*characters _"]
) -> Values:
    """Return how much lower a leg needs the pelvis to be (..., F), m; infinite out of reach.

    target: of the leg's end (..., F, 3), m. sunk: by how much the pelvis is lowered already, m.
    """
    apart = poses.position(leg.upper) - np.asarray(sunk)[..., None] * UP - target
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


def lower(needs: Sequence[Values], most: Values, rate: float, cyclic: bool) -> Values:
    """Return how much the pelvis is lowered (..., F), m: smoothly, by `most` (..., F) at most."""
    wanted = np.minimum(np.max([np.zeros(most.shape), *needs], axis=0), most)
    smooth = cover(wanted, rate, cyclic)
    excess = cover(np.maximum(smooth - most, 0.0), rate, cyclic)
    return np.maximum(smooth - excess, 0.0)


def cover(needed: Values, rate: float, cyclic: bool) -> Values:
    """Return a smooth path (..., F) that is nowhere below the needed one, which is not negative.

    The largest value of the neighbourhood, smoothed with a kernel that is no wider than that.
    """
    half = max(1, round(SPREAD * rate))
    if not needed.any():
        return needed
    kernel = np.exp(-0.5 * np.square(np.arange(-half, half + 1) / (SMOOTHING * rate)))
    wide = np.max(_neighbours(needed, half, cyclic), axis=0)
    found = np.zeros(needed.shape)
    # Not a matrix product, whose sums could go in another order for more characters.
    for share, moved in zip(kernel / kernel.sum(), _neighbours(wide, half, cyclic), strict=True):
        found += share * moved
    return found


def beyond(needed: Values, most: Values) -> Booleans:
    """Return whether a leg needs more than the pelvis can be lowered (..., F)."""
    found: Booleans = needed > most + 1e-9
    return found


def _neighbours(values: Values, half: int, cyclic: bool) -> list[Values]:
    """Return the values (..., F) moved by -half to half frames."""
    around = [(0, 0)] * (values.ndim - 1) + [(half, half)]
    wide = np.pad(values, around, mode="wrap" if cyclic else "edge")
    return [wide[..., first : first + values.shape[-1]] for first in range(2 * half + 1)]
