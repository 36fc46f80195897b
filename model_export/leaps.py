"""Leaps: joints that get farther between two frames than anything around those frames explains."""

from dataclasses import dataclass

import numpy as np

from service.motion.clip import Clip
from service.motion.conventions import Floats

# The pace around a frame is the median over so much time to either side, s: a leap, or a leap
# there and one back, does not move it, and whoever sets off moves on.
AROUND = 0.035
# A leap is so many times the pace around it, and goes so much farther, m.
TIMES, FARTHER = 8.0, 0.03


@dataclass(frozen=True)
class Leap:
    """Where a clip's joint leaps farthest: from frame to frame + 1, by a distance, m, so many
    times the pace around it. whole: whether most of the body leaps along."""

    frame: int
    joint: int
    distance: float
    times: float
    whole: bool


def worst(clip: Clip) -> Leap | None:
    """The farthest leap of a clip, where there is one."""
    steps = np.linalg.norm(np.diff(clip.positions(), axis=0), axis=-1)
    pace = np.maximum(_pace(steps, max(2, round(AROUND * clip.rate))), FARTHER / TIMES / 4)
    beyond = steps - pace
    leaping = (beyond > FARTHER) & (steps > TIMES * pace)
    if not leaping.any():
        return None
    frame, joint = np.unravel_index(int(np.argmax(np.where(leaping, beyond, 0.0))), steps.shape)
    found, usual = float(steps[frame, joint]), float(pace[frame, joint])
    return Leap(int(frame), int(joint), found, found / usual, bool(leaping[frame].mean() > 0.5))


def _pace(steps: Floats, reach: int) -> Floats:
    """Median (F - 1, J) of steps over `reach` frames to either side."""
    padded = np.pad(steps, ((reach, reach), (0, 0)), mode="edge")
    windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * reach + 1, axis=0)
    return np.asarray(np.median(windows, axis=-1))
