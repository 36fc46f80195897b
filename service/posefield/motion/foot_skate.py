"""Foot skate: sliding of planted feet."""

from collections.abc import Sequence
from typing import Annotated

import numpy as np

from posefield.common import frame_groups
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


def mean_skate_speeds(
    feet: Sequence[Annotated[Floats, "_ _ 3"]], rates: Sequence[float]
) -> list[float]:
    """Return `mean_skate_speed` of the feet (F, K, 3) of several motions.

    Each has the bytes that it has alone. Motions with equally many feet are measured at once.
    """
    found: dict[int, float] = {}
    counts = [own.shape[1] for own in feet]
    for count in dict.fromkeys(counts):
        places = [place for place, own in enumerate(counts) if own == count]
        speeds = _mean_speeds([feet[at] for at in places], np.array([rates[at] for at in places]))
        found |= zip(places, speeds.tolist(), strict=True)
    return [found[place] for place in range(len(feet))]


def _mean_speeds(
    feet: Sequence[Annotated[Floats, "_ feet 3"]], rates: Annotated[Floats, "motions"]
) -> Annotated[Floats, "motions"]:
    """Return the mean speeds (M,) of planted feet (F, K, 3), m/s; K feet in each motion."""
    groups = frame_groups.of_lengths(feet)
    whole = np.concatenate(feet)
    heights = whole @ UP
    lowest = np.minimum.reduceat(heights, groups.starts, axis=0)[groups.group]
    down = heights < lowest + PLANTED_HEIGHT
    planted = np.zeros(down.shape, bool)
    planted[:-1] = down[1:] & down[:-1]
    # The step from the last frame of a motion to the first of the next is none.
    planted[groups.starts + groups.counts - 1] = False
    moved = np.diff(whole, axis=0, append=whole[-1:])
    speeds = rates[groups.group, None] * np.hypot(moved[..., 0], moved[..., 2])
    counts = groups.sums(planted.astype(float)).sum(axis=1)
    found: Floats = groups.sums(speeds * planted).sum(axis=1) / np.maximum(counts, 1.0)
    return found
