"""Stances and swings of feet: from contact probabilities, as captured feet step.

Frames lie on a grid of equal steps of time. A stance of a cycle may go on over its end: its frames
are then counted beyond the last.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

import numpy as np

from posefield.common.units import UP, Booleans, Floats, Frames, RootPath
from posefield.locomotion import floor_plane
from posefield.locomotion.floor_plane import FloorVectors
from posefield.motion import contact_detection

# Contacts that are shorter are dropped, and gaps that are shorter are closed, s.
SHORTEST_CONTACT = contact_detection.DEFAULT.shortest
SHORTEST_GAP = contact_detection.DEFAULT.shortest_gap
# A swing that goes less is none, m.
SHORTEST_STEP = 0.03
# A foot that is higher above the place where it stands is in the air whatever the plan says, m.
LIFTED = contact_detection.DEFAULT.grown_height
# A foot may stand this much higher or lower than captured feet do, m: soles differ.
UNEVEN = 0.01
# Step from which on a swing is lifted to the full clearance, m.
FULL_STEP = 0.1
# A foot leaves the floor, and comes back to it, over this time, s: the knee of a straight leg moves
# several times as fast as its foot is lifted. The exponent of the lift between both.
RISE, LIFT_EXPONENT = 0.09, 0.2
# A foot in the middle of a full step is at least this high above its place, m.
LEAST_LIFT = 0.025
# Mean acceleration of a lift, m/s²: a short swing is not lifted as high as a captured one.
LIFT_ACCELERATION = 12.0


@dataclass(frozen=True)
class Cycle:
    """Floor motion from the start of a cycle to its end.

    way: displacement, m. turn: change of heading, rad.
    """

    way: complex
    turn: float

    @property
    def factor(self) -> complex:
        """Return the unit vector of the turn."""
        return complex(np.exp(1j * self.turn))


@dataclass(frozen=True)
class Interval:
    """Frames `begin` to `end`, exclusive, of a stance or a swing; `end` may lie after a cycle."""

    begin: int
    end: int

    def __len__(self) -> int:
        return self.end - self.begin


@dataclass(frozen=True)
class FootPath:
    """Predicted path of the joint that contacts, over the grid.

    positions: (F, 3), m. rate: frames a second. cycle: None where the motion does not repeat.
    walking: whether the motion walks in each frame (F,); None for a motion that is no walk.
    """

    positions: RootPath
    rate: float
    cycle: Cycle | None = None
    walking: Annotated[Booleans, "frames"] | None = None

    def __len__(self) -> int:
        return len(self.positions)

    @cached_property
    def floor(self) -> Annotated[FloorVectors, "frames"]:
        """Return the path over the floor (F,)."""
        return floor_plane.project(self.positions)

    @cached_property
    def heights(self) -> Frames:
        """Return the heights (F,), m."""
        found: Frames = self.positions @ UP
        return found

    def places(self, frames: Sequence[int]) -> Annotated[FloorVectors, "frames"]:
        """Return floor points at frames, which may lie within a cycle after the last."""
        index = np.asarray(frames)
        found: FloorVectors = self.floor[index % len(self)]
        if self.cycle is None:
            return found
        after = self.cycle.way + self.cycle.factor * found
        moved: FloorVectors = np.where(index >= len(self), after, found)
        return moved


def mask(intervals: Sequence[Interval], frames: int) -> Annotated[Booleans, "frames"]:
    """Return whether each of F frames is in one of the intervals."""
    found = np.zeros(frames, bool)
    for interval in intervals:
        found[np.arange(interval.begin, interval.end) % frames] = True
    return found


def runs(down: Annotated[Booleans, "frames"], cyclic: bool) -> list[Interval]:
    """Return the intervals of true frames, in order; one of a cycle may go over its end."""
    found = contact_detection.runs(down, cyclic)
    intervals = [Interval(int(own[0]), int(own[0]) + len(own)) for own in found]
    return sorted(intervals, key=lambda own: own.begin)


def highest_lift(seconds: float | Floats) -> float | Floats:
    """Return how high a foot is lifted at most in a swing of a duration, m: by a parabola."""
    return LIFT_ACCELERATION * seconds**2 / 8.0


def lift_shares(share: Frames, seconds: float | Frames) -> Frames:
    """Return the shares (S,) of a lift at shares of swings that last some seconds.

    The foot leaves the floor, and comes to it, at rest.
    """
    quickest = np.maximum(seconds / RISE, 2.0)
    soon = np.minimum(np.minimum(share, 1.0 - share) * quickest, 1.0)
    found: Frames = np.sin(np.pi * share) ** LIFT_EXPONENT * soon**2 * (3.0 - 2.0 * soon)
    return found
