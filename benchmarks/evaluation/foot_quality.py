"""Measures of a motion's feet, knees and smoothness at one frame rate."""

from dataclasses import dataclass

import numpy as np

from posefield.common.units import UP, Floats
from posefield.motion import contact_detection
from posefield.motion.clip import Clip
from posefield_train.align import time_alignment
from posefield_train.evaluate.motion_errors import END_FRAMES

# Highest frame rate at which motions are measured, frames a second.
HIGHEST_RATE = 60.0
# Height below which a foot slides by the measure of Zhang et al. 2018 (MANN, section 6.2), m, and
# the percentile of the foot's own heights that it is counted from.
SLIDING_HEIGHT, GROUND_PERCENTILE = 0.025, 2.0


@dataclass(frozen=True)
class FootQuality:
    """Measures of one motion.

    skate: mean speed of planted feet (`mean_skate_speed`), m/s. weighted_skate: mean speed of low
    feet, weighted by height (MANN), m/s. acceleration: mean over joints relative to the root, m/s².
    peak, first, last: the largest of a frame, that of the first and of the last three, m/s².
    knee_peak, knee_mean: 99th percentile and mean of the knees' acceleration relative to the root,
    m/s². lowest: height of the lowest foot in any frame, m.
    """

    skate: float
    weighted_skate: float
    acceleration: float
    peak: float
    first: float
    last: float
    knee_peak: float
    knee_mean: float
    lowest: float


def measure(clip: Clip, rate: float, feet: tuple[int, ...], knees: tuple[int, ...]) -> FootQuality:
    """Return the measures of a clip at a frame rate.

    feet, knees: joint indices, at least one of either.
    """
    positions = _positions(clip, rate)
    relative = positions - positions[:, :1]
    bends = np.linalg.norm(np.diff(relative, n=2, axis=0), axis=-1) * rate**2
    down = positions[:, list(feet)]
    of_frames = bends[:, 1:].mean(axis=1)
    first, last = of_frames[:END_FRAMES], of_frames[-END_FRAMES:]
    of_knees = bends[:, list(knees)]
    return FootQuality(
        float(contact_detection.mean_skate_speed(down, rate)),
        weighted_skate_speed(down, rate),
        float(of_frames.mean()),
        float(of_frames.max()),
        float(first.mean()),
        float(last.mean()),
        float(np.percentile(of_knees, 99.0)),
        float(of_knees.mean()),
        float((down @ UP).min()),
    )


def weighted_skate_speed(feet: Floats, rate: float) -> float:
    """Return the mean horizontal speed of low feet (F, K, 3), m/s, weighted by their height.

    The weight of a speed is 2 - 2^(h / 2.5 cm) at a height h of less than 2.5 cm above the foot's
    own ground (Zhang et al. 2018, section 6.2). Zero if no foot is low.
    """
    heights = feet @ UP
    above = np.maximum(heights - np.percentile(heights, GROUND_PERCENTILE, axis=0), 0.0)[1:]
    speeds = rate * np.linalg.norm(np.diff(feet, axis=0) * (1.0 - UP), axis=-1)
    low = above < SLIDING_HEIGHT
    weighted = speeds * (2.0 - 2.0 ** (above / SLIDING_HEIGHT))
    return float(weighted[low].mean()) if low.any() else 0.0


def _positions(clip: Clip, rate: float) -> Floats:
    """Return joint positions (F, J, 3), m, at a frame rate."""
    steps = max(round(clip.duration * rate), 3)
    positions = clip.positions()
    flat = positions.reshape(len(positions), -1)
    resampled = time_alignment.interpolate(flat, np.linspace(0.0, 1.0, steps + 1))
    return resampled.reshape(-1, *positions.shape[1:])
