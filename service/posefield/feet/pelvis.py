"""Lowering of the pelvis, so that the legs reach the places where the feet stand."""

from collections.abc import Sequence
from typing import Annotated

import numpy as np

from posefield.common.array_shapes import Frames
from posefield.common.frame_groups import FrameRows
from posefield.common.units import UP, Booleans, Floats
from posefield.feet import two_bone
from posefield.feet.limbs import Limb, LimbPoses, Points, Values

# The pelvis is lowered this long before and after it is needed, s, and its way is smoothed with a
# Gaussian that is half as wide.
SPREAD, SMOOTHING = 0.06, 0.03
# It is lowered no more than this, m.
MOST = 0.05

Lowering = Annotated[Floats, "frames"]


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


def lower(needs: Sequence[Lowering], most: Lowering, rows: FrameRows) -> Lowering:
    """Return how much the pelvis is lowered (N,), m: smoothly, by `most` (N,) at most.

    needs: of each leg (N,), m. rows: of the motions, one after another.
    """
    wanted = np.minimum(np.max([np.zeros(most.shape), *needs], axis=0), most)
    smooth = cover(wanted, rows)
    excess = cover(np.maximum(smooth - most, 0.0), rows)
    return np.maximum(smooth - excess, 0.0)


def cover(needed: Lowering, rows: FrameRows) -> Lowering:
    """Return smooth paths (N,) that are nowhere below the needed ones, which are not negative.

    The largest value of the neighbourhood, smoothed with a kernel that is no wider than that.
    """
    found = np.zeros(needed.shape)
    if not needed.any():
        return found
    halves = np.maximum(1, np.round(SPREAD * rows.rates)).astype(np.int64)
    for half in np.unique(halves).tolist():
        own = halves == half
        frames = own[rows.groups.group]
        found[frames] = _covered(needed[frames], rows.select(np.flatnonzero(own)), half)
    return found


def _covered(needed: Lowering, rows: FrameRows, half: int) -> Lowering:
    """Return smooth paths as `cover` does, of rows whose neighbourhoods are of one size."""
    around = range(-half, half + 1)
    kernel = [np.exp(-0.5 * np.square(offset / (SMOOTHING * rows.rates))) for offset in around]
    beside = [rows.beside(offset) for offset in around]
    wide = np.max([needed[frames] for frames in beside], axis=0)
    found = np.zeros(needed.shape)
    # Not a matrix product, whose sums could go in another order for more motions.
    total = sum(kernel)
    for share, frames in zip(kernel, beside, strict=True):
        found += (share / total)[rows.groups.group] * wide[frames]
    return found


def beyond(needed: Values, most: Values) -> Booleans:
    """Return whether a leg needs more than the pelvis can be lowered (..., F)."""
    found: Booleans = needed > most + 1e-9
    return found
