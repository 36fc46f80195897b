"""Random walks that keep distances: each character goes around those before it.

Prioritised planning (Erdmann and Lozano-Pérez, "On multiple moving objects", 1987): the walks of
earlier characters are known functions of time, counted in a grid of time and space. A character
that would meet one of them goes slower, faster or to one side for a while. Speeds and rates of
turning stay within those of the gait, and no character depends on later ones.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from posefield.common import cancellation
from posefield.common.units import Floats, Indices
from posefield.locomotion import floor_plane
from posefield.locomotion.floor_plane import FloorVectors
from posefield.locomotion.gait import GaitRegion

RADIUS = 0.25
"""Radius of a character seen from above, m: half the width of the shoulders."""
CLEARANCE = 0.65
"""Distance of walks at their steps, m. Between two steps characters that meet head on come nearer,
and a pelvis sways.
"""
STEP, CELL = 0.25, 0.2
"""Step of time, s, and side of a cell, m."""
MOST_CELLS = 1 << 28
"""Largest grid, of one byte a cell, of which memory holds what is counted in. Characters of crowds
that it is too small for keep their walks.
"""
START = 3
"""Steps at the beginning in which the places where others start stay free."""
FACTORS, SIDES = (1.0, 0.85, 1.15, 0.7, 1.3, 0.55, 1.5), (0.0, 0.5, -0.5, 1.0, -1.0)
"""Changes of the speed, and of turning as shares of what is left to the limits."""
RAMP, HOLDS = 6, (6, 16)
"""Steps in which a change begins and ends, and in which it lasts."""
BEFORE, AHEAD = (16, 8, 28, 40), 24
"""Steps before a meeting at which a change may begin, and after it for which it is tried."""
PROGRESS, MOST_CHANGES = 4, 48
"""Least number of steps by which a change delays a meeting, and most changes of a walk."""
STARTS, HEADINGS, SHIFT = 48, 12, 0.04
"""Starts that are tried, those among them that differ in their heading alone, and the distance by
which each further one lies farther from the drawn one, m.
"""
GOLDEN_ANGLE = np.pi * (3.0 - np.sqrt(5.0))
"""Angle between the headings of starts, rad."""
SPEED_MARGIN, TURNING_SHARE, SPEEDS = 0.05, 0.9, 65
"""Share of the gait's speeds that is left out at either end, where little turning was sampled;
share of its turning that is used, and number of speeds at which it is tabulated.
"""

Steps = Annotated[Floats, "*#walks steps"]
Points = Annotated[FloorVectors, "*#walks steps"]


@dataclass(frozen=True)
class RandomWalks:
    """Walks of N characters at T steps of time.

    starts: (N,). headings: (N,), rad, of the starts. speeds, turning: (N, T), m/s and rad/s.
    """

    starts: Annotated[FloorVectors, "characters"]
    headings: Annotated[Floats, "characters"]
    speeds: Annotated[Floats, "characters steps"]
    turning: Annotated[Floats, "characters steps"]


@dataclass(frozen=True)
class _Walk:
    """A walk (T,), or some of them (C, T): speeds, turning, headings, rad, and points."""

    speeds: Steps
    turning: Steps
    headings: Steps
    points: Points


def keep_distances(
    region: GaitRegion, walks: RandomWalks, later: Annotated[FloorVectors, "later"]
) -> RandomWalks:
    """Return the walks, changed so that they keep `CLEARANCE`; one that cannot meets others.

    later: starts of characters that would follow in a larger crowd, so that this one is its first
    part.
    """
    starts = np.concatenate([walks.starts, later])
    side = math.isqrt(MOST_CELLS // walks.speeds.shape[1])
    if CELL * side < max(np.ptp(starts.real), np.ptp(starts.imag)) + 2.0 * CLEARANCE:
        return walks
    grid = _Grid(walks.speeds.shape[1], side)
    planner, standing = _Planner(region, grid), np.ones(START)
    for start in starts:
        grid.count(start * standing, 1)
    kept = []
    for start, heading, *rates in zip(*vars(walks).values(), strict=True):
        cancellation.check()
        grid.count(start * standing, -1)
        walk = planner.plan(start, heading, *rates)
        grid.count(walk.points, 1)
        kept.append(walk)
    return RandomWalks(
        np.array([walk.points[0] for walk in kept]),
        np.array([walk.headings[0] for walk in kept]),
        np.stack([walk.speeds for walk in kept]),
        np.stack([walk.turning for walk in kept]),
    )


class _Grid:
    """Numbers of characters within `CLEARANCE` of cells (T, side, side) of time and space.

    Space repeats itself after `side` cells, which bounds the memory: far characters may be avoided
    needlessly, and none is overlooked.
    """

    def __init__(self, steps: int, side: int) -> None:
        self._side, self._counts = side, np.zeros(steps * side * side, dtype=np.uint8)
        reach = int(CLEARANCE / CELL) + 1
        rows, columns = np.mgrid[-reach : reach + 1, -reach : reach + 1].reshape(2, -1) * CELL
        # A point may lie half a diagonal from the middle of its cell.
        near = np.hypot(rows, columns) <= CLEARANCE + CELL / np.sqrt(2.0)
        self._disc = (rows + 1j * columns)[near]

    def count(self, points: Annotated[FloorVectors, "steps"], change: int) -> None:
        """Add to the numbers around the points of a walk at its first steps."""
        cells = self._cells(points[:, None] + self._disc, np.arange(len(points))[:, None])
        # Cells of one walk differ, so that none is counted twice.
        self._counts[cells] += np.uint8(change % 256)

    def meetings(self, points: Points, first: int) -> Annotated[Indices, "..."]:
        """Return the first steps (...) at which points (..., K) are near a character.

        first: step of the first point. The step after the last for points that are near none.
        """
        met = self._counts[self._cells(points, first + np.arange(points.shape[-1]))] > 0
        return first + np.where(met.any(axis=-1), met.argmax(axis=-1), met.shape[-1])

    def _cells(self, points: Points, steps: Indices) -> Indices:
        rows, columns = (self._wrapped(axis) for axis in (points.real, points.imag))
        return (steps * self._side + rows) * self._side + columns

    def _wrapped(self, axis: Floats) -> Indices:
        cells = np.floor(axis / CELL)
        # Far faster than the remainder of integers.
        return (cells - self._side * np.floor(cells / self._side)).astype(np.int64)


class _Planner:
    def __init__(self, region: GaitRegion, grid: _Grid) -> None:
        self._grid = grid
        low, high = region.speeds
        margin = SPEED_MARGIN * (high - low)
        self._speeds = np.linspace(low + margin, high - margin, SPEEDS)
        self._limits = [TURNING_SHARE * limit for limit in region.turning(self._speeds)]
        options = sorted(
            ((factor, side, hold) for factor in FACTORS for side in SIDES for hold in HOLDS),
            key=lambda option: (abs(math.log(option[0])) + 0.5 * abs(option[1]), option[2]),
        )
        self._factors, self._sides, holds = np.transpose(options)[:, :, None]
        steps = np.arange(max(BEFORE) + AHEAD)
        self._bumps = np.clip(np.minimum(steps, 2 * RAMP + holds - steps) / RAMP, 0.0, 1.0)

    def plan(self, start: complex, heading: float, speeds: Steps, turning: Steps) -> _Walk:
        """Return the walk of the first start without a meeting, else that of the latest meeting."""
        walks = []
        for number in range(STARTS):
            turned = heading + GOLDEN_ANGLE * number
            shift = SHIFT * max(number - HEADINGS, 0) * floor_plane.unit_vectors(turned)
            walk = _follow(complex(start + shift), turned, speeds, turning)
            walk, meeting = self._change_until_free(walk, speeds, turning)
            walks.append((meeting, walk))
            if meeting == len(speeds):
                break
        return max(walks, key=lambda pair: pair[0])[1]

    def _change_until_free(self, walk: _Walk, speeds: Steps, turning: Steps) -> tuple[_Walk, int]:
        """Return a walk with changes, and its first meeting; the last step for none."""
        factors, sides = np.ones(len(speeds)), np.zeros(len(speeds))
        meeting = int(self._grid.meetings(walk.points, 0))
        for _ in range(MOST_CHANGES):
            if meeting == len(speeds):
                break
            for window in _windows(meeting, len(speeds)):
                bumps = self._bumps[:, : window.stop - window.start]
                tried_factors = factors[window] + bumps * (self._factors - factors[window])
                tried_sides = sides[window] + bumps * (self._sides - sides[window])
                rates = self._rates(speeds[window], turning[window], tried_factors, tried_sides)
                tried = _follow(walk.points[window.start], walk.headings[window.start], *rates)
                meetings = self._grid.meetings(tried.points, window.start)
                latest = int(np.argmax(meetings))
                if meetings[latest] >= min(meeting + PROGRESS, window.stop):
                    break
            else:
                break
            factors[window], sides[window] = tried_factors[latest], tried_sides[latest]
            rates = self._rates(speeds, turning, factors, sides)
            walk = _follow(walk.points[0], walk.headings[0], *rates)
            meeting = int(self._grid.meetings(walk.points, 0))
        return walk, meeting

    def _rates(
        self, speeds: Steps, turning: Steps, factors: Steps, sides: Steps
    ) -> tuple[Steps, Steps]:
        """Return changed speeds and rates of turning, within the gait's."""
        changed = np.clip(speeds * factors, self._speeds[0], self._speeds[-1])
        low, high = (np.interp(changed, self._speeds, limit) for limit in self._limits)
        bent = np.clip(turning, low, high)
        return changed, bent + np.where(sides < 0.0, bent - low, high - bent) * sides


def _windows(meeting: int, last: int) -> Iterator[slice]:
    """Yield the steps of changes that may avoid a meeting."""
    for begin in dict.fromkeys(max(meeting - before, 0) for before in BEFORE):
        yield slice(begin, min(meeting + AHEAD, last))


def _follow(start: complex, heading: float, speeds: Steps, turning: Steps) -> _Walk:
    headings = heading + cumulative_integrals(turning)
    middle = 0.5 * (headings[..., 1:] + headings[..., :-1])
    steps = 0.5 * STEP * (speeds[..., 1:] + speeds[..., :-1]) * floor_plane.unit_vectors(middle)
    points = np.empty(speeds.shape, dtype=np.complex128)
    points[..., 0] = start
    points[..., 1:] = start + np.cumsum(steps, axis=-1)
    return _Walk(speeds, turning, headings, points)


def cumulative_integrals(rates: Steps) -> Steps:
    """Return the integrals (..., T) of rates (..., T) at steps of time, by the trapezoidal rule."""
    integrals = np.zeros_like(rates)
    np.cumsum(0.5 * STEP * (rates[..., 1:] + rates[..., :-1]), axis=-1, out=integrals[..., 1:])
    return integrals


OVERLAP_INTERVAL = 0.1
"""Time between the frames in which overlaps are looked for, s."""
MOST_POINTS = 5_000_000
"""Largest number of points of walks between which overlaps are looked for."""


@dataclass(frozen=True)
class Overlap:
    """Two characters by index, and the time, s, at which they first overlap."""

    first: int
    second: int
    seconds: float


def is_searchable(characters: int, frames: int, rate: float) -> bool:
    """Return whether a crowd is small enough to look for overlaps."""
    return characters * len(_looked_at(frames, rate)) <= MOST_POINTS


def _looked_at(frames: int, rate: float) -> Indices:
    return np.arange(0, frames, max(1, round(OVERLAP_INTERVAL * rate)))


def find_overlaps(
    places: Annotated[FloorVectors, "characters frames"], rate: float
) -> list[Overlap]:
    """Return the pairs of characters that come nearer than twice `RADIUS`, the earliest first.

    places: (N, F), m, at `rate` frames a second.
    """
    frames = _looked_at(places.shape[1], rate)
    across = places[:, frames].T
    order = np.argsort(across.real, axis=1, kind="stable")
    across = np.take_along_axis(across, order, axis=1)
    firsts: dict[tuple[int, int], int] = {}
    # Characters that overlap are near one another in the order of one coordinate.
    for shift in range(1, len(places)):
        cancellation.check()
        gaps = across[:, shift:] - across[:, :-shift]
        if not (gaps.real < 2.0 * RADIUS).any():
            break
        at, row = np.nonzero(np.abs(gaps) < 2.0 * RADIUS)
        pairs = np.sort([order[at, row], order[at, row + shift]], axis=0).T.tolist()
        for pair, frame in zip(pairs, frames[at].tolist(), strict=True):
            key = pair[0], pair[1]
            firsts[key] = min(frame, firsts.get(key, frame))
    found = sorted((frame, pair) for pair, frame in firsts.items())
    return [Overlap(*pair, frame / rate) for frame, pair in found]
