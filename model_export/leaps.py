"""Detection of jumps of joints between two frames that exceed the speed around them."""

from dataclasses import dataclass

import numpy as np

from service.motion.clip import Clip
from service.motion.conventions import Floats

# The speed around a frame is the median over this time to either side, s. A jump, or a jump and its
# return, does not change the median; the start of a motion does.
AROUND = 0.035
# A step is a jump if it exceeds the median by the factor TIMES and by FARTHER, m.
TIMES, FARTHER = 8.0, 0.03


@dataclass(frozen=True)
class Leap:
    """The largest jump of a clip, from frame to frame + 1.

    distance: of the joint, m. times: ratio to the median step around it. whole: True if more than
    half of the joints jump too.
    """

    frame: int
    joint: int
    distance: float
    times: float
    whole: bool


def worst(clip: Clip) -> Leap | None:
    """Return the largest jump of a clip; None if there is none."""
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
    """Return the median (F - 1, J) of steps over `reach` frames to either side."""
    padded = np.pad(steps, ((reach, reach), (0, 0)), mode="edge")
    windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * reach + 1, axis=0)
    return np.asarray(np.median(windows, axis=-1))
