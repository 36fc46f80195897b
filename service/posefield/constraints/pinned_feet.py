"""Pinned feet: planted feet keep their predicted positions during a correction.

A pin is a soft constraint with a standard deviation of LOOSE: positions of a planted foot every few
frames, with the predicted ones as targets. Foot skate in the prediction remains.
"""

from collections.abc import Sequence
from typing import Annotated

import numpy as np

from posefield.common.array_shapes import RootPath, Variables
from posefield.common.units import UP, Booleans
from posefield.constraints.constraint import PositionConstraint
from posefield.constraints.motion_variables import MotionVariables
from posefield.motion.foot_skate import PLANTED_HEIGHT
from posefield.motion.measures import Measure

# Standard deviation of a pinned foot's position, m.
PIN_DEVIATION = 0.01
# Of the canonical frames in which a foot is planted, every eighth is pinned, and the last.
PIN_INTERVAL = 8


def build_pins(
    scene: MotionVariables, numbers: Variables, feet: Sequence[int]
) -> list[PositionConstraint]:
    """Return the pins of the feet of a motion, for each foot where it is planted."""
    return [pin for foot in feet for pin in _foot_pins(scene, numbers, foot)]


def _foot_pins(scene: MotionVariables, numbers: Variables, foot: int) -> list[PositionConstraint]:
    places = np.arange(float(scene.reduced.frames))
    path = scene.positions(numbers, foot, places)
    moment = Measure("height", (foot,), "landmark")
    return [
        PositionConstraint((f"foot {foot}",), moment, (0, 1, 2), path[frame], float(frame))
        for frame in _pinned_frames(is_planted(path))
    ]


def is_planted(path: RootPath) -> Annotated[Booleans, "frames"]:
    """Return whether a foot on a path (F, 3), m, is planted at each frame (F,).

    It is planted where its height is near its lowest for at least two consecutive frames.
    """
    heights = path @ UP
    near = heights < heights.min() + PLANTED_HEIGHT
    before, after = np.roll(near, 1), np.roll(near, -1)
    before[0] = after[-1] = False
    found: Booleans = near & (before | after)
    return found


def _pinned_frames(stands: Annotated[Booleans, "frames"]) -> list[int]:
    """Return frames of each planted interval: every EVERY-th, including the first and the last."""
    frames = np.flatnonzero(stands)
    runs = np.split(frames, np.flatnonzero(np.diff(frames) > 1) + 1)
    return [
        int(f) for run in runs if len(run) for f in {*run[::PIN_INTERVAL].tolist(), int(run[-1])}
    ]
