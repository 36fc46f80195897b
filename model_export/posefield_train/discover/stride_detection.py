"""Strides of walks and runs: from a left foot most forward to the next.

The distance of the feet along the heading of the hips swings once a stride. Its extrema are the
cuts, so that a stride begins and ends in the same pose.
"""

from dataclasses import dataclass

import numpy as np

from posefield.common.units import Floats
from posefield_train.discover.recordings import Recording

SMOOTHING = 0.1
"""Duration of the moving mean, s."""
HYSTERESIS, LEAST = 0.25, 0.08
"""Least swing between two extrema, and least distance of the feet at one, leg lengths."""
SHORTEST, LONGEST = 0.5, 2.6
"""Durations of a stride, s."""
EARLIEST, LATEST = 0.25, 0.75
"""Share of a stride within which the right foot is most forward."""
LEAST_TRAVEL = 0.4
"""Least way of the hips as a share of the swing of the feet."""
WAY_STEP = 0.1
"""Time between two places of which the way of the hips is measured, s."""


@dataclass(frozen=True)
class Stride:
    """Frames of a stride; both show the left foot most forward.

    travel: way of the hips as a share of the swing of the feet, half of it where feet that stand
    carry the body.
    """

    first: int
    last: int
    travel: float

    @property
    def travels(self) -> bool:
        """Return whether the body goes on; a kick or a step in place swings the feet too."""
        return self.travel >= LEAST_TRAVEL


def find_strides(recording: Recording) -> list[Stride]:
    """Return the strides of a recording, in order, those in place too; two in a row share a frame.

    Within them no joint leaps.
    """
    # Distance (F,) by which the left foot is before the right, leg lengths, smooth.
    angles, across = recording.headings(), recording.across("Foot")
    ahead = across[:, 2] * np.cos(angles) + across[:, 0] * np.sin(angles)
    signal = moving_mean(ahead, round(SMOOTHING * recording.rate))
    extrema = alternating_extrema(signal)
    found = []
    for (first, kind), (middle, _), (last, _) in zip(
        extrema, extrema[1:], extrema[2:], strict=False
    ):
        share = (middle - first) / (last - first)
        is_far = min(signal[first], -signal[middle], signal[last]) > LEAST
        lasts = SHORTEST <= (last - first) / recording.rate <= LONGEST
        is_one = lasts and EARLIEST <= share <= LATEST and recording.is_whole(first, last)
        if kind > 0 and is_far and is_one:
            swing = signal[first] + signal[last] - 2.0 * signal[middle]
            # Horizontal way of the hips, leg lengths.
            step = max(1, round(WAY_STEP * recording.rate))
            hips = recording.places["hips"][first : last + 1 : step, [0, 2]]
            way = float(np.linalg.norm(np.diff(hips, axis=0), axis=1).sum())
            found.append(Stride(first, last, way / swing))
    return found


def moving_mean(values: Floats, frames: int) -> Floats:
    """Return the mean (F,) of a window of an odd number of frames; the ends are held."""
    half = max(frames, 1) // 2
    padded = np.concatenate([[0.0], np.cumsum(np.pad(values, half, mode="edge"))])
    return np.asarray((padded[2 * half + 1 :] - padded[: -2 * half - 1]) / (2 * half + 1))


def alternating_extrema(values: Floats) -> list[tuple[int, int]]:
    """Return the extrema of a signal (F,): index and sign, 1 of a maximum, -1 of a minimum.

    An extremum counts once the signal left it by HYSTERESIS; then the search for the opposite one
    begins. The first and the last frame are no extrema.
    """
    found: list[tuple[int, int]] = []
    low = high = 0
    sign = 0
    for at, value in enumerate(values):
        high = at if value > values[high] else high
        low = at if value < values[low] else low
        if sign >= 0 and value < values[high] - HYSTERESIS:
            found += [(high, 1)] if high > 0 else []
            sign, low = -1, at
        elif sign <= 0 and value > values[low] + HYSTERESIS:
            found += [(low, -1)] if low > 0 else []
            sign, high = 1, at
    return found
