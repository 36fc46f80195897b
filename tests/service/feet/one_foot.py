"""Stances and paths of one foot, by loops and dense systems: the oracle of those of many feet."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from posefield.common.units import MICROMETRES
from posefield.feet.ball_path import HOLD
from posefield.feet.smooth_change import SPREAD
from posefield.feet.stances import (
    LIFTED,
    SHORTEST_CONTACT,
    SHORTEST_GAP,
    SHORTEST_STEP,
    Cycle,
    FootPath,
    Interval,
    mask,
    runs,
)
from posefield.motion.foot_contacts import FootContact


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


def smooth_change(
    path: np.ndarray,
    intervals: Sequence[Interval],
    rate: float,
    cycle: Cycle | None = None,
    values: np.ndarray | None = None,
    fixed: np.ndarray | None = None,
) -> np.ndarray:
    """Return the path (F,) of smoothest change that is constant in each interval.

    path: (F,), real or complex. rate: frames a second. cycle: motion from frame 0 to frame F; None
    where the path does not repeat. values: of the intervals, if they are given. fixed: values (F,)
    of single frames, and thereby of the intervals that they are in; not a number in other frames.
    A path with fixed values does not repeat.
    """
    through = np.flatnonzero(~np.isnan(fixed)) if fixed is not None else np.zeros(0, np.int64)
    if not intervals and not len(through):
        return path
    count = len(path)
    groups, firsts = _groups(count, intervals)
    bends = _bends(count, cycle)
    factor, way = (1.0, 0.0) if cycle is None else (cycle.factor, cycle.way)
    # y = scale * u[groups] + shift: a stance that goes on over the end has its place in the next
    # cycle, which is moved back.
    after = mask([Interval(0, i.end - count) for i in intervals if i.end > count], count)
    scale = np.where(after, np.conj(factor), 1.0)
    shift = np.where(after, -np.conj(factor) * way, 0.0)
    if np.isrealobj(path):
        scale, shift = scale.real, shift.real
    stiffness = (SPREAD * rate) ** 4
    goal = _right_side(bends, groups, scale, stiffness, path - shift)
    known = np.zeros(len(firsts), path.dtype)
    free = np.ones(len(firsts), bool)
    if values is not None:
        own = groups[[interval.begin for interval in intervals]]
        known[own], free[own] = values, False
    if fixed is not None:
        known[groups[through]], free[groups[through]] = fixed[through], False
    if free.any():
        matrix = _normal_matrix(bends, groups, scale, stiffness)
        goal = goal - matrix @ known
        known[free] = np.linalg.solve(matrix[np.ix_(free, free)], goal[free])
    found: np.ndarray = scale * known[groups] + shift
    return found


def held(path: FootPath, found: Sequence[Interval], goal: np.ndarray) -> list[Interval]:
    """Return the stances with the ends of the swings in which the foot keeps its place.

    A point to which it is led ends a swing.
    """
    count, hold, led = len(path), round(HOLD * path.rate), ~np.isnan(goal[:, 0])
    longer = []
    for index, stance in enumerate(found):
        ways = led[: stance.begin][::-1], led[stance.end :]
        gaps = _gap(found, index - 1, path), _gap(found, index, path)
        before, after = (
            min(hold, min(gap, int(np.argmax(way)) if way.any() else gap) // 4)
            for gap, way in zip(gaps, ways, strict=True)
        )
        longer.append(Interval(stance.begin - before, stance.end + after))
    if path.cycle is None:
        return [Interval(max(i.begin, 0), min(i.end, count)) for i in longer]
    return [Interval(i.begin % count, i.begin % count + min(len(i), count)) for i in longer]


def _gap(found: Sequence[Interval], index: int, path: FootPath) -> int:
    """Return the number of frames from a stance to the next; 0 to an end of the clip."""
    count = len(path)
    if path.cycle is not None:
        own, after = found[index % len(found)], found[(index + 1) % len(found)]
        return int((after.begin - own.end) % count)
    if not 0 <= index < len(found) - 1:
        return 0
    return found[index + 1].begin - found[index].end


@dataclass(frozen=True)
class _Bends:
    """Second differences: frames (R, 3) of each, and their factors (R, 3)."""

    frames: np.ndarray
    factors: np.ndarray


def _bends(count: int, cycle: Cycle | None) -> _Bends:
    """Return the second differences of F frames; those of a cycle go on over its end."""
    if cycle is None:
        frames = np.arange(max(count - 2, 0))[:, None] + np.arange(3)
        return _Bends(frames, np.tile([1.0, -2.0, 1.0], (len(frames), 1)))
    frames = np.arange(count)[:, None] + np.arange(-1, 2)
    factor = cycle.factor
    turned = np.where(frames < 0, np.conj(factor), np.where(frames >= count, factor, 1.0))
    return _Bends(frames % count, turned * [1.0, -2.0, 1.0])


def _normal_matrix(
    bends: _Bends, groups: np.ndarray, scale: np.ndarray, stiffness: float
) -> np.ndarray:
    """Return the matrix (U, U) of the quadratic form of the unknowns."""
    columns = groups[bends.frames]
    values = _matching(bends.factors, scale) * scale[bends.frames]
    size = int(groups.max()) + 1
    found = np.zeros((size, size), values.dtype)
    for row in range(3):
        for column in range(3):
            own = stiffness * np.conj(values[:, row]) * values[:, column]
            np.add.at(found, (columns[:, row], columns[:, column]), own)
    found[np.arange(size), np.arange(size)] += np.bincount(groups)
    return found


def _right_side(
    bends: _Bends,
    groups: np.ndarray,
    scale: np.ndarray,
    stiffness: float,
    path: np.ndarray,
) -> np.ndarray:
    """Return the right side (U,) of the normal equations."""
    factors = _matching(bends.factors, scale)
    bent = np.sum(factors * path[bends.frames], axis=-1)
    weighted = path.copy()
    np.add.at(weighted, bends.frames, stiffness * np.conj(factors) * bent[:, None])
    found = np.zeros(int(groups.max()) + 1, path.dtype)
    np.add.at(found, groups, np.conj(scale) * weighted)
    return found


def _matching(factors: np.ndarray, like: np.ndarray) -> np.ndarray:
    """Return factors that are real where others are."""
    return factors.real if np.isrealobj(like) else factors


def _groups(count: int, intervals: Sequence[Interval]) -> tuple[np.ndarray, np.ndarray]:
    """Return the unknown of each frame (F,), and the first frame of each unknown.

    All frames of an interval share one unknown; the others have one each.
    """
    leader = np.arange(count)
    for interval in intervals:
        leader[np.arange(interval.begin, interval.end) % count] = interval.begin
    firsts, groups = np.unique(leader, return_inverse=True)
    return groups, firsts
