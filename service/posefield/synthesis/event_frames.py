"""Frames at the moments of events and targets: time of a motion against time as it is played.

Frames are played at a constant rate. A moment between two of them would be seen in neither, so the
motion is played up to half a frame earlier or later there, and eases from one such moment to the
next: at each, and at its ends, it has its own speed.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from posefield.common.units import Floats, Frames, round_micrometres
from posefield.motion.quat import smoothstep

# Tolerance for the rounding of products of times and rates, in frames.
ROUNDING = 1e-6


@dataclass(frozen=True)
class Playback:
    """Times of a motion over the times at which it is played.

    rate: frames a second. start: time of a frame, s. knots: of moments on frames and of the ends
    (K,), in frames from the start. shifts: by which these are later in the motion (K,), s.
    """

    rate: float
    start: float
    knots: Annotated[Floats, "knots"]
    shifts: Annotated[Floats, "knots"]

    @property
    def duration(self) -> float:
        """Time at which the end of the motion is played, s."""
        return self.start + float(self.knots[-1]) / self.rate

    def times(self, last: float) -> Frames:
        """Return the times (F,) in the motion, s, of the frames from the start until `last`, s."""
        frames = np.arange(math.floor((last - self.start) * self.rate + ROUNDING) + 1)
        after = np.clip(np.searchsorted(self.knots, frames), 1, len(self.knots) - 1)
        length = self.knots[after] - self.knots[after - 1]
        share = smoothstep(np.clip((frames - self.knots[after - 1]) / length, 0.0, 1.0))
        before, step = self.shifts[after - 1], self.shifts[after] - self.shifts[after - 1]
        # At a knot the sum with its share of one would round.
        shifts = np.where(frames == self.knots[after], self.shifts[after], before + share * step)
        return np.asarray(self.start + frames / self.rate + shifts)

    def stretch(self, times: Frames) -> float:
        """Return the largest distance of times (F,) of frames from when they are played, s."""
        frames = np.arange(len(times)) / self.rate
        return round_micrometres(np.abs(self.start + frames - times).max())


def playback(rate: float, start: float, duration: float, moments: Sequence[float]) -> Playback:
    """Return the playback of a motion with a frame at `start`, s, in which moments have frames.

    rate: frames a second. duration: of the motion, s. moments: s; of two with the same nearest
    frame the first has it, and one whose nearest frame is before the motion has none.
    """
    begin, end = -start * rate, (duration - start) * rate
    shifts = {}
    for moment in reversed(moments):
        frame = round((moment - start) * rate)
        if frame >= begin - ROUNDING:
            shifts[float(frame)] = moment - start - frame / rate
    if not any(abs(knot - begin) < ROUNDING for knot in shifts):
        shifts[begin] = 0.0
    # The end plays at its own time, unless it is a moment or one before it has the last frame.
    if len(shifts) == 1 or (duration not in moments and max(shifts) < end - ROUNDING):
        shifts[end] = 0.0
    knots, sizes = zip(*sorted(shifts.items()), strict=True)
    return Playback(rate, start, np.array(knots), np.array(sizes))
