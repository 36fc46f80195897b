"""Pinned feet: planted feet keep their predicted positions during a correction.

A pin is a soft constraint with a standard deviation of LOOSE: positions of a planted foot every few
frames, with the predicted ones as targets. Foot skate in the prediction remains.
"""

from collections.abc import Sequence

import numpy as np

from posefield.common.units import UP, Floats, Truths
from posefield.constraints.constraint import Place
from posefield.constraints.motion_variables import Scene
from posefield.motion.foot_skate import PLANTED
from posefield.motion.measures import Measure

# Standard deviation of a pinned foot's position, m.
LOOSE = 0.01
# Of the canonical frames in which a foot is planted, every eighth is pinned, and the last.
EVERY = 8


def pins(scene: Scene, numbers: Floats, feet: Sequence[int]) -> list[Place]:
    """Return the pins of the feet of a motion, for each foot where it is planted."""
    return [pin for foot in feet for pin in _of(scene, numbers, foot)]


def _of(scene: Scene, numbers: Floats, foot: int) -> list[Place]:
    places = np.arange(float(scene.reduced.frames))
    path = scene.positions(numbers, foot, places)
    moment = Measure("height", (foot,), "landmark")
    return [
        Place((f"foot {foot}",), moment, (0, 1, 2), path[frame], float(frame))
        for frame in _chosen(down(path))
    ]


def down(path: Floats) -> Truths:
    """Return whether a foot on a path (F, 3), m, is planted at each frame (F,).

    It is planted where its height is near its lowest for at least two consecutive frames.
    """
    heights = path @ UP
    near = heights < heights.min() + PLANTED
    before, after = np.roll(near, 1), np.roll(near, -1)
    before[0] = after[-1] = False
    found: Truths = near & (before | after)
    return found


def _chosen(stands: Truths) -> list[int]:
    """Return frames of each planted interval: every EVERY-th, including the first and the last."""
    frames = np.flatnonzero(stands)
    runs = np.split(frames, np.flatnonzero(np.diff(frames) > 1) + 1)
    return [int(f) for run in runs if len(run) for f in {*run[::EVERY].tolist(), int(run[-1])}]
