"""Random walks that keep distances: each character goes around those before it.

Prioritised planning (Erdmann and Lozano-Pérez, "On multiple moving objects", 1987): the walks of
earlier characters are known functions of time, counted in a grid of time and space. A character
that would meet one of them goes slower, faster or to one side for a while. Speeds and rates of
turning stay within those of the gait, and no character depends on later ones. The random numbers of
a character are one row of a table: they depend on the seed and its index, not on the crowd's size.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from posefield.common import cancellation
from posefield.common.units import CharacterPoints, Floats, Indices, PerCharacter
from posefield.locomotion import floor_plane, stride
from posefield.locomotion.floor_plane import FloorVectors
from posefield.locomotion.gait import Gait, GaitRegion
from posefield.locomotion.locomotion_plan import POINT_SPACING, Paths
from posefield.motion.clip import Placement

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


# Spacing of the initial grid, and largest offset of a character from its grid point, m.
SPACING, MAX_JITTER = 2.0, 0.5
# Phases of neighbours on the grid in each direction, and their largest variation: any of the eight
# neighbours differ by at least a tenth of a cycle.
PHASE_STEPS, PHASE_VARIATION = (0.4, 0.2), 0.1
# Rings of the grid around a crowd whose starts are kept free.
RINGS = 2
# Wavelengths, m, and weights of the variation of turning and speed along a path.
WAVELENGTHS, WAVE_WEIGHTS = np.array([23.0, 11.0, 6.1]), np.array([0.5, 0.3, 0.2])
# Share of the sampled turning that is used, and relative variation of the speed.
DRAWN_TURNING, SPEED_VARIATION = 0.8, 0.15


@dataclass(frozen=True)
class Characters:
    """Performers, phases and random numbers of N characters.

    who: (N,), labels by index in `stride.label_rows`, -1 for a model without any. phases: (N,), of
    the cycle at the beginning. random_numbers: (N, columns), random numbers from 0 to 1 for the
    paths. later: (M,), starts of further characters of the seed, around these.
    """

    who: Annotated[Indices, "characters"]
    phases: PerCharacter
    random_numbers: Annotated[Floats, "characters columns"]
    later: Annotated[FloorVectors, "later"]


def draw_characters(gait: Gait, count: int, seed: int) -> Characters:
    """Return the characters of a seed."""
    all_rows = _random_table((int(np.ceil(np.sqrt(count))) + RINGS) ** 2, seed)
    table, (rows, columns) = all_rows[:count], grid_cells(count)
    phases = PHASE_STEPS[0] * rows + PHASE_STEPS[1] * columns + PHASE_VARIATION * table[:, 1]
    later = _starts(all_rows[:, 2:4])[count:]
    return Characters(gait.labels.draw(table[:, 0]), phases % 1.0, table[:, 2:], later)


def initial_placement(count: int, seed: int) -> Placement:
    """Return the initial positions and headings of `count` characters' paths."""
    numbers = _random_table(count, seed)[:, 2:]
    return Placement(
        floor_plane.at_height(_starts(numbers[:, :2]), np.zeros(count)), _initial_headings(numbers)
    )


def draw_paths(gait: Gait, characters: Characters, seconds: float) -> Paths:
    """Return random paths that keep their distances, long enough for `seconds`.

    Beyond them a path goes on with its last speed and curvature.
    """
    walks = _draw_walks(gait, characters, seconds)
    walks = keep_distances(gait.region, walks, characters.later)
    count = int(np.ceil(gait.region.speeds[1] * seconds / POINT_SPACING)) + 3
    along = np.linspace(0.0, (count - 1) * POINT_SPACING, count)
    gone = cumulative_integrals(walks.speeds)
    speeds, turning = (
        np.stack([np.interp(along, *pair) for pair in zip(gone, rates, strict=True)])
        for rates in (walks.speeds, walks.turning)
    )
    # Curvatures, 1/m. The trapezoidal rule: that of a step is the mean of those at its ends.
    bends = turning / speeds
    turns = np.cumsum(0.5 * POINT_SPACING * (bends[:, 1:] + bends[:, :-1]), axis=1)
    headings = walks.headings[:, None] + np.pad(turns, ((0, 0), (1, 0)))
    return Paths(walks.starts, headings, speeds)


def _draw_walks(gait: Gait, characters: Characters, seconds: float) -> RandomWalks:
    """Return random walks of characters that do not know of one another."""
    numbers = characters.random_numbers
    waves = 2.0 * np.pi * numbers[:, 4:].reshape(len(numbers), 2, len(WAVELENGTHS))
    mean_speeds = _captured_speeds(gait, characters.who, numbers[:, 3])
    along = mean_speeds * STEP * np.arange(int(np.ceil(seconds / STEP)) + 2)
    speeds = _speeds(gait, mean_speeds, _wave(along, waves[:, 0]))
    low, high = gait.region.turning(speeds)
    # Straight where the wave is zero.
    turning = _vary(DRAWN_TURNING * _wave(along, waves[:, 1]), low, np.zeros(1), high)
    return RandomWalks(_starts(numbers[:, :2]), _initial_headings(numbers), speeds, turning)


def _random_table(count: int, seed: int) -> Annotated[Floats, "{count} columns"]:
    return np.random.Generator(np.random.PCG64(seed)).random((count, 6 + 2 * len(WAVELENGTHS)))


def _initial_headings(
    numbers: Annotated[Floats, "characters columns"],
) -> PerCharacter:
    return 2.0 * np.pi * numbers[:, 2]


def _starts(spot: Annotated[Floats, "characters 2"]) -> Annotated[FloorVectors, "characters"]:
    """Return starts (N,), m, on a grid numbered in growing squares.

    A character's start does not depend on how many characters follow.
    """
    rows, columns = grid_cells(len(spot))
    jitter = MAX_JITTER * (2.0 * spot - 1.0)
    return (SPACING * rows + jitter[:, 0]) + 1j * (SPACING * columns + jitter[:, 1])


def grid_cells(
    count: int,
) -> tuple[Annotated[Indices, "characters"], Annotated[Indices, "characters"]]:
    """Return the rows and columns (N,) of a grid that is numbered in growing squares."""
    number = np.arange(count)
    ring = np.sqrt(number).astype(np.int64)
    on = number - ring**2
    return np.minimum(2 * ring - on, ring), np.minimum(on, ring)


def _wave(
    along: Annotated[Floats, "characters steps"], phases: Annotated[Floats, "characters waves"]
) -> Annotated[Floats, "characters steps"]:
    """Return values (N, T) from -1 to 1 that vary smoothly along (N, T) m."""
    angles = 2.0 * np.pi * along[..., None] / WAVELENGTHS + phases[:, None]
    return np.sin(angles) @ WAVE_WEIGHTS


def _captured_speeds(
    gait: Gait, combinations: Annotated[Indices, "characters"], numbers: PerCharacter
) -> Annotated[Floats, "characters 1"]:
    """Return speeds (N, 1), m/s, of captured clips, each of the character's own performer."""
    moved_by = stride.clip_performers(gait.session.card)
    order = np.argsort(moved_by, kind="stable")
    first, after = (
        np.searchsorted(moved_by[order], combinations, side) for side in ("left", "right")
    )
    clips = order[first + (numbers * (after - first)).astype(np.int64)]
    return gait.rates[clips, :1]


def _speeds(
    gait: Gait,
    mean_speeds: Annotated[Floats, "characters 1"],
    wave: CharacterPoints,
) -> CharacterPoints:
    """Return speeds (N, K), m/s, that vary about the mean ones (N, 1)."""
    captured = np.array(gait.region.speeds)
    low, high = captured + SPEED_MARGIN * (captured[::-1] - captured)
    middle = np.clip(mean_speeds, low, high)
    slower = np.maximum((1.0 - SPEED_VARIATION) * middle, low)
    faster = np.minimum((1.0 + SPEED_VARIATION) * middle, high)
    return _vary(wave, slower, middle, faster)


def _vary(wave: Floats, low: Floats, middle: Floats, high: Floats) -> Floats:
    return middle + np.where(wave < 0.0, middle - low, high - middle) * wave
