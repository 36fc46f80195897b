"""Pinned feet: a planted foot stays at one place on the floor.

A pin is a soft constraint with a standard deviation of PIN_DEVIATION: positions of a planted foot
every few frames, with the mean place of the stance and the predicted heights as targets. The stance
of a cycle goes on over its end.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from posefield.common.array_shapes import RootPath, Variables, Vector
from posefield.common.units import UP, Booleans, Floats
from posefield.constraints.constraint import PositionConstraint
from posefield.constraints.motion_variables import MotionVariables
from posefield.motion import quat
from posefield.motion.foot_skate import PLANTED_HEIGHT
from posefield.motion.measures import Measure

# Standard deviation of a pinned foot's position, m.
PIN_DEVIATION = 0.003
# Of the canonical frames in which a foot is planted, every sixth is pinned, and the last.
PIN_INTERVAL = 6
# A foot is loose if it leaves the place of its stance by more than this, m.
LOOSE = 0.015

Indices = np.ndarray[tuple[int, ...], np.dtype[np.int64]]
"""Indices of canonical frames, in order."""
Quaternion = Annotated[Floats, "4"]


@dataclass(frozen=True)
class FootPins:
    """Stances of one foot. frames: planted canonical frames (S,). places: their targets (S, 3)."""

    foot: int
    frames: Indices
    places: RootPath

    def constraints(self) -> list[PositionConstraint]:
        """Return the soft constraints of the foot."""
        moment = Measure("height", (self.foot,), "landmark")
        return [
            PositionConstraint(
                (f"foot {self.foot}",), moment, (0, 1, 2), self.places[i], float(self.frames[i])
            )
            for i in _picked(self.frames)
        ]

    def slide(self, scene: MotionVariables, numbers: Variables) -> float:
        """Return the largest horizontal distance, m, of a motion's foot from its pins."""
        if not len(self.frames):
            return 0.0
        path = scene.positions(numbers, self.foot, self.frames.astype(np.float64))
        return float(np.linalg.norm((path - self.places) * (1.0 - UP), axis=-1).max())


def build_pins(
    scene: MotionVariables, numbers: Variables, feet: Sequence[int]
) -> tuple[FootPins, ...]:
    """Return the pins of the feet of a predicted motion."""
    return tuple(_foot_pins(scene, numbers, foot) for foot in feet)


def _foot_pins(scene: MotionVariables, numbers: Variables, foot: int) -> FootPins:
    path = scene.positions(numbers, foot, np.arange(float(scene.reduced.frames)))
    frames = np.flatnonzero(is_planted(path))
    places = path.copy()
    runs = list(_runs(frames))
    # The last pose of a cycle leads into the first: one stance may lie on both sides.
    wraps = scene.cyclic and len(runs) > 1 and runs[0][0] == 0 and runs[-1][-1] == len(path) - 1
    if wraps:
        way, turn = _cycle_step(scene, numbers)
        both = np.concatenate([path[runs[0]], quat.rotate(quat.conj(turn), path[runs[-1]] - way)])
        mean = both.mean(axis=0)
        places[runs[0]] = _on_floor(path[runs[0]], mean)
        places[runs[-1]] = _on_floor(path[runs[-1]], way + quat.rotate(turn, mean))
    for run in runs[1:-1] if wraps else runs:
        places[run] = _on_floor(path[run], path[run].mean(axis=0))
    return FootPins(foot, frames, places[frames])


def _cycle_step(scene: MotionVariables, numbers: Variables) -> tuple[Vector, Quaternion]:
    """Return the way (3,), m, and the rotation (4,) from a cycle's start to its end."""
    left, ahead, heading = scene.duration_and_travel(numbers)[1]
    return np.array([left, 0.0, ahead]), quat.from_axis_angle(UP, np.asarray(heading))


def _on_floor(path: RootPath, mean: Vector) -> RootPath:
    """Return the points (S, 3) of a path with the horizontal place of a mean (3,)."""
    return path * UP + mean * (1.0 - UP)


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


def _runs(frames: Indices) -> Iterator[Indices]:
    """Yield the intervals of consecutive frames."""
    for run in np.split(frames, np.flatnonzero(np.diff(frames) > 1) + 1):
        if len(run):
            yield run


def _picked(frames: Indices) -> list[int]:
    """Return indices of pinned frames: of each interval every PIN_INTERVAL-th, and the last."""
    starts = np.searchsorted(frames, [run[0] for run in _runs(frames)])
    found = []
    for start, run in zip(starts.tolist(), _runs(frames), strict=True):
        found += sorted({*range(start, start + len(run), PIN_INTERVAL), start + len(run) - 1})
    return found
