"""Stances of one foot, by loops: the oracle of those of many feet."""

from collections.abc import Sequence

import numpy as np

from posefield.common.units import MICROMETRES
from posefield.feet.stances import (
    LIFTED,
    SHORTEST_CONTACT,
    SHORTEST_GAP,
    SHORTEST_STEP,
    FootPath,
    Interval,
    mask,
    runs,
)
from posefield.motion.contact_detection import FootContact


def tidy(down: np.ndarray, rate: float, cyclic: bool) -> list[Interval]:
    """Return the runs of true frames; short gaps are closed, then short contacts dropped."""
    gaps = runs(~down, cyclic)
    closed = down.copy()
    for gap in gaps:
        # A gap at an end of the clip is a part of a swing.
        inner = cyclic or (gap.begin > 0 and gap.end < len(down))
        if inner and len(gap) < SHORTEST_GAP * rate:
            closed[np.arange(gap.begin, gap.end) % len(down)] = True
    found = runs(closed, cyclic)
    return [
        stance
        for stance in found
        if len(stance) >= SHORTEST_CONTACT * rate
        or not (cyclic or (stance.begin > 0 and stance.end < len(down)))
    ]


def discipline(stances: Sequence[Interval], path: FootPath, foot: FootContact) -> list[Interval]:
    """Return stances whose swings are as captured ones: they go somewhere, and do not last.

    A swing that goes less than 3 cm is none. One that lasts longer than the captured ones is cut
    to their median duration, where the predicted foot goes most. Slow walkers take longer steps in
    time than most captured ones: swings within a walk stay as they are. A foot that is in the air
    does not stand.
    """
    down = mask(stances, len(path))
    for swing in runs(~down, path.cycle is not None):
        frames = np.arange(swing.begin, swing.end)
        grounded = path.heights[frames % len(path)] < foot.height + LIFTED
        kept = _swing_frames(swing, path, foot)
        down[frames[~kept & grounded] % len(path)] = True
    return tidy(down, path.rate, path.cycle is not None)


def _swing_frames(swing: Interval, path: FootPath, foot: FootContact) -> np.ndarray:
    """Return the frames of a swing in which the foot swings indeed."""
    inner = path.cycle is not None or (swing.begin > 0 and swing.end < len(path))
    if inner:
        ends = path.places([swing.begin - 1 if swing.begin else 0, swing.end])
        if abs(ends[1] - ends[0]) < SHORTEST_STEP:
            return np.zeros(len(swing), bool)
    frames = np.arange(swing.begin, swing.end) % len(path)
    walks = path.walking is not None and bool(path.walking[frames].all())
    if walks or len(swing) <= foot.longest_swing * path.rate:
        return np.ones(len(swing), bool)
    length = min(max(2, round(foot.swing * path.rate)), len(swing) - 1)
    places = path.places(range(swing.begin, swing.end))
    gone = np.round(np.abs(places[length:] - places[:-length]), MICROMETRES)
    first = int(np.argmax(gone))
    found = np.zeros(len(swing), bool)
    found[first : first + length] = True
    return found


def shortened(found: Sequence[Interval], beyond: np.ndarray, path: FootPath) -> list[Interval]:
    """Return the stances without the frames in which the leg does not reach."""
    count, shorter = len(path), []
    for stance in found:
        kept = ~beyond[np.arange(stance.begin, stance.end) % count]
        longest = max(runs(kept, False), key=len, default=Interval(0, 0))
        if len(longest) >= SHORTEST_CONTACT * path.rate:
            begin, end = stance.begin + longest.begin, stance.begin + longest.end
            # A stance of a cycle begins within it.
            whole = count if begin >= count else 0
            shorter.append(Interval(begin - whole, end - whole))
    return sorted(shorter, key=lambda own: own.begin)
