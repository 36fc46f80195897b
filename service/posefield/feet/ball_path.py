"""Path of the joint that contacts: the smoothest change of the predicted path that stands.

The path y minimises the sum of |y - f|² + (tau r)⁴ |D² (y - f)|² and is constant in each stance: a
thin-plate prior on the change, conditioned on standing. f is the predicted path, r the rate and D²
the second difference. Places over the floor are complex numbers, so that the turn of a cycle is a
factor, and a cycle closes exactly.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
import numpy.typing as npt

from posefield.common.array_shapes import RootPath
from posefield.common.units import UP, Floats, Indices
from posefield.feet import banded_systems, stances
from posefield.feet.stances import Cycle, FootPath, Interval
from posefield.locomotion import floor_plane
from posefield.motion.foot_contacts import FootContact
from posefield.question.floor import LEVEL_FLOOR, Floor

# Time over which a change of the path is spread, s.
SPREAD = 0.1
# A foot keeps its place over the floor for this time before and after a swing, while it is low, s.
HOLD = 0.05

Numbers = npt.NDArray[Any]


@dataclass(frozen=True)
class Footsteps:
    """Planned path of one foot over the grid.

    positions: (F, 3), m. stances: frames in which it stands. anchors: where, (S, 3), m, in the
    coordinates of each stance's first frame.
    """

    positions: RootPath
    stances: tuple[Interval, ...]
    anchors: Annotated[Floats, "stances 3"]

    def on_floor(self, floor: Floor) -> "Footsteps":
        """Return the steps of a floor at height 0 on another floor."""
        if floor == LEVEL_FLOOR:
            return self
        moved = self.positions + floor.heights(self.positions)[:, None] * UP
        anchors = self.anchors + floor.heights(self.anchors)[:, None] * UP
        return Footsteps(moved, self.stances, anchors)


def plan_path(
    path: FootPath, found: Sequence[Interval], foot: FootContact, goal: RootPath | None = None
) -> Footsteps:
    """Return the path of a foot that stands in the intervals `found`.

    goal: points (F, 3), m, that the path goes through; not a number in other frames.
    """
    height = foot.height
    goal = np.full(path.positions.shape, np.nan) if goal is None else goal
    held = _held(path, found, goal)
    floor_path = smooth_change(
        path.floor, held, path.rate, path.cycle, fixed=floor_plane.project(goal)
    )
    heights = smooth_change(
        path.heights,
        found,
        path.rate,
        None if path.cycle is None else Cycle(0.0, 0.0),
        np.full(len(found), height),
        goal[:, 1],
    )
    placed = FootPath(floor_plane.at_height(floor_path, heights), path.rate, path.cycle)
    added, least = stances.lifts(placed, found, foot, goal[:, 1])
    heights = np.maximum(heights + added, height + least)
    positions = floor_plane.at_height(floor_path, heights)
    anchors = positions[[stance.begin for stance in found]].reshape(-1, 3)
    return Footsteps(positions, tuple(found), anchors)


def smooth_change(
    path: Numbers,
    intervals: Sequence[Interval],
    rate: float,
    cycle: Cycle | None = None,
    values: Floats | None = None,
    fixed: Numbers | None = None,
) -> Numbers:
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
    after = stances.mask([Interval(0, i.end - count) for i in intervals if i.end > count], count)
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
    if cycle is None:
        bands = _normal_bands(bends, groups, stiffness)
        known = banded_systems.solve(bands, goal, ~free, known)
    elif free.any():
        matrix = _normal_matrix(bends, groups, scale, stiffness)
        goal = goal - matrix @ known
        known[free] = np.linalg.solve(matrix[np.ix_(free, free)], goal[free])
    found: Numbers = scale * known[groups] + shift
    return found


@dataclass(frozen=True)
class _Bends:
    """Second differences: frames (R, 3) of each, and their factors (R, 3)."""

    frames: Annotated[Indices, "rows 3"]
    factors: Annotated[Numbers, "rows 3"]


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
    bends: _Bends, groups: Annotated[Indices, "frames"], scale: Numbers, stiffness: float
) -> Numbers:
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


def _normal_bands(
    bends: _Bends, groups: Annotated[Indices, "frames"], stiffness: float
) -> Annotated[Floats, "3 size"]:
    """Return the diagonals of the matrix of a path that does not repeat.

    Unknowns are in the order of their frames, so a second difference couples neighbours alone.
    """
    columns, size = groups[bends.frames], int(groups.max()) + 1
    found = np.zeros((3, size))
    found[0] = np.bincount(groups, minlength=size)
    for row in range(3):
        for column in range(row, 3):
            first, apart = columns[:, row], columns[:, column] - columns[:, row]
            # A product off the diagonal of the frames counts twice on that of a stance.
            share = np.where((apart == 0) & (row != column), 2.0, 1.0)
            own = stiffness * share * bends.factors[:, row] * bends.factors[:, column]
            found += np.bincount(apart * size + first, own, 3 * size).reshape(3, size)
    return found


def _right_side(
    bends: _Bends,
    groups: Annotated[Indices, "frames"],
    scale: Numbers,
    stiffness: float,
    path: Numbers,
) -> Numbers:
    """Return the right side (U,) of the normal equations."""
    factors = _matching(bends.factors, scale)
    bent = np.sum(factors * path[bends.frames], axis=-1)
    weighted = path.copy()
    np.add.at(weighted, bends.frames, stiffness * np.conj(factors) * bent[:, None])
    found = np.zeros(int(groups.max()) + 1, path.dtype)
    np.add.at(found, groups, np.conj(scale) * weighted)
    return found


def _matching(factors: Numbers, like: Numbers) -> Numbers:
    """Return factors that are real where others are."""
    return factors.real if np.isrealobj(like) else factors


def _groups(
    count: int, intervals: Sequence[Interval]
) -> tuple[Annotated[Indices, "frames"], Annotated[Indices, "groups"]]:
    """Return the unknown of each frame (F,), and the first frame of each unknown.

    All frames of an interval share one unknown; the others have one each.
    """
    leader = np.arange(count)
    for interval in intervals:
        leader[np.arange(interval.begin, interval.end) % count] = interval.begin
    firsts, groups = np.unique(leader, return_inverse=True)
    return groups, firsts


def _held(path: FootPath, found: Sequence[Interval], goal: RootPath) -> list[Interval]:
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
