"""Contacts of a foot found in its motion, for models without contact probabilities."""

from collections.abc import Sequence
from typing import Annotated

import numpy as np

from posefield.common.array_shapes import Frames
from posefield.common.units import UP, Booleans
from posefield.feet import stances
from posefield.feet.stances import FootPath, Interval
from posefield.motion.foot_contacts import FootContact

# A foot is certainly down below the first speed, m/s, and height, m, and it stays down below the
# second ones. Heights are above a low percentile of the foot's own heights.
SEED_SPEED, SEED_HEIGHT = 0.20, 0.035
SPEED, HEIGHT = 0.45, 0.0525
GROUND_PERCENTILE = 2.0
# Standard deviation of the smoothing of speeds, s.
SMOOTHING = 0.012
# Swings of a motion in which no foot swings: median and longest duration, s.
DEFAULT_SWING, DEFAULT_LONGEST = 0.3, 0.5


def detect(path: FootPath) -> Annotated[Booleans, "frames"]:
    """Return whether the foot is in contact at each frame (F,): hysteresis of speed and height."""
    speeds, heights = _speeds(path), path.heights
    heights = heights - np.percentile(heights, GROUND_PERCENTILE)
    seeds = (speeds < SEED_SPEED) & (heights < SEED_HEIGHT)
    grown = (speeds < SPEED) & (heights < HEIGHT)
    found = np.zeros(len(path), bool)
    for run in stances.runs(grown, path.cycle is not None):
        frames = np.arange(run.begin, run.end) % len(path)
        found[frames] = seeds[frames].any()
    return found


def describe(joint: int, path: FootPath, found: Sequence[Interval]) -> FootContact:
    """Return the statistics of a foot's contacts in one motion."""
    down = stances.mask(found, len(path))
    heights = path.heights
    height = float(np.median(heights[down])) if down.any() else float(heights.min())
    inner = [
        swing
        for swing in stances.runs(~down, path.cycle is not None)
        if path.cycle is not None or (swing.begin > 0 and swing.end < len(path))
    ]
    if not inner:
        return FootContact(joint, height, DEFAULT_SWING, DEFAULT_LONGEST, 0.0)
    seconds = [len(swing) / path.rate for swing in inner]
    lifts = [
        float(heights[np.arange(swing.begin, swing.end) % len(path)].max()) - height
        for swing in inner
    ]
    return FootContact(
        joint,
        height,
        float(np.median(seconds)),
        float(max(np.percentile(seconds, 90), np.median(seconds))),
        max(0.0, float(np.percentile(lifts, 75))),
    )


def _speeds(path: FootPath) -> Frames:
    """Return the smoothed speeds (F,), m/s."""
    heights = path.heights
    if path.cycle is None:
        speed = np.linalg.norm(np.gradient(path.positions, 1.0 / path.rate, axis=0), axis=-1)
        mode = "edge"
    else:
        count = len(path)
        places = path.places(range(count + 1))
        along = np.abs(np.diff(places))
        rise = np.diff(np.append(heights, heights[0]))
        after = np.hypot(along, rise) * path.rate
        speed, mode = 0.5 * (after + np.roll(after, 1)), "wrap"
    half = int(np.ceil(3.0 * SMOOTHING * path.rate))
    kernel = np.exp(-0.5 * np.square(np.arange(-half, half + 1) / (SMOOTHING * path.rate)))
    padded = np.pad(speed, half, mode=mode)  # type: ignore[call-overload]
    found: Frames = np.convolve(padded, kernel / kernel.sum(), mode="valid")
    return found
