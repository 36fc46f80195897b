"""Stances and swings of feet: from contact probabilities, as captured feet step.

Frames lie on a grid of equal steps of time. A stance of a cycle may go on over its end: its frames
are then counted beyond the last.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

import numpy as np

from posefield.common.array_shapes import Frames, RootPath
from posefield.common.units import MICROMETRES, UP, Booleans, Floats
from posefield.locomotion import floor_plane
from posefield.locomotion.floor_plane import FloorVectors
from posefield.motion.contacts import contact_detection
from posefield.motion.foot_contacts import FootContact

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


def tidy(down: Annotated[Booleans, "frames"], rate: float, cyclic: bool) -> list[Interval]:
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


def mask(intervals: Sequence[Interval], frames: int) -> Annotated[Booleans, "frames"]:
    """Return whether each of F frames is in one of the intervals."""
    found = np.zeros(frames, bool)
    for interval in intervals:
        found[np.arange(interval.begin, interval.end) % frames] = True
    return found


def _swing_frames(
    swing: Interval, path: FootPath, foot: FootContact
) -> Annotated[Booleans, "some"]:
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


def runs(down: Annotated[Booleans, "frames"], cyclic: bool) -> list[Interval]:
    """Return the intervals of true frames, in order; one of a cycle may go over its end."""
    found = contact_detection.runs(down, cyclic)
    intervals = [Interval(int(own[0]), int(own[0]) + len(own)) for own in found]
    return sorted(intervals, key=lambda own: own.begin)


def shortened(
    found: Sequence[Interval], beyond: Annotated[Booleans, "frames"], path: FootPath
) -> list[Interval]:
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


def lifts(
    path: FootPath, found: Sequence[Interval], foot: FootContact, led: Frames
) -> tuple[Frames, Frames]:
    """Return how much a swinging foot is lifted (F,), m, and its least height (F,) while it swings.

    led: heights (F,), m, of points to which the foot is led; not a number in other frames. Such a
    point ends a swing. A foot whose prediction is lifted as captured feet are is not lifted more.
    Zero in stances, or less where the foot is led to a place below the floor.
    """
    count = len(path)
    added, lowest = np.zeros(count), np.fmin(led - foot.height, 0.0)
    for stance in found:
        own = np.arange(stance.begin, stance.end) % count
        lowest[own] = lowest[own].min()
    ended = mask(found, count) | ~np.isnan(led)
    for swing in runs(~ended, path.cycle is not None):
        whole = _whole(swing, path, foot)
        if whole is None:
            continue
        share = _shares(swing, path, whole)
        ends = _ends(swing, path)
        begin, end = path.places(ends)
        least = foot.clearance * min(abs(end - begin) / FULL_STEP, 1.0)
        if path.cycle is not None or (swing.begin > 0 and swing.end < count):
            least = min(least, float(highest_lift(len(swing) / path.rate)))
        first, last = (float(lowest[end % count]) for end in ends)
        least = 0.0 if min(first, last) < -UNEVEN else least
        frames = np.arange(swing.begin, swing.end) % count
        rise = lift_shares(share, whole / path.rate)
        lifted = max(float(path.heights[frames].max()) - foot.height, 0.0)
        added[frames] = max(least * float(rise.max()) - lifted, 0.0) * rise
        lowest[frames] = min(least, LEAST_LIFT) * rise + first + share * (last - first)
    return added, lowest


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


def _whole(swing: Interval, path: FootPath, foot: FootContact) -> int | None:
    """Return the steps of time from stance to stance of a swing; None for one without a stance.

    A swing at an end of a clip goes on outside it, for the usual duration.
    """
    count, length = len(path), len(swing)
    cyclic = path.cycle is not None
    leads, trails = (not cyclic and swing.begin == 0), (not cyclic and swing.end == count)
    if (leads and trails) or (cyclic and length == count):
        return None
    return max(length, round(foot.swing * path.rate)) + 1 if leads or trails else length + 1


def _shares(swing: Interval, path: FootPath, whole: int) -> Frames:
    """Return the shares (S,), 0 to 1, of a swing at its frames. whole: steps of time, as above."""
    leads = path.cycle is None and swing.begin == 0
    steps = np.arange(1.0, len(swing) + 1.0)
    return (steps + (whole - 1 - len(swing)) * leads) / whole


def _ends(swing: Interval, path: FootPath) -> list[int]:
    """Return the frames in which a foot stands before and after a swing, or the clip's ends."""
    if path.cycle is None:
        return [max(swing.begin - 1, 0), min(swing.end, len(path) - 1)]
    after = len(path) if swing.begin == 0 else 0
    return [swing.begin - 1 + after, swing.end + after]
