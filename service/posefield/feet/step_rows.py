"""Paths of the feet of many walkers at once: the smoothest change of the predicted paths.

As `ball_path`, with each foot at the mean of its predicted places in a stance. With the places
given, each swing is a system of its own: its change is a linear function of the changes in the two
frames before it and the two after it, by a matrix that depends on the swing's length alone. So all
swings of one length are solved by one product.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated

import numpy as np

from posefield.common.units import Booleans, Floats, Indices
from posefield.feet import stance_rows
from posefield.feet.ball_path import HOLD, SPREAD, Numbers
from posefield.feet.stance_rows import FootRows, Rows, Runs
from posefield.feet.stances import FULL_STEP, LEAST_LIFT, highest_lift, lift_shares
from posefield.locomotion import floor_plane
from posefield.locomotion.floor_plane import FloorVectors

# A change is over after this time, s: it falls by e every 0.14 s.
FADING = 2.0
# Matrices of swings of this many different lengths are kept.
LENGTHS = 256

Heights = Annotated[Floats, "rows frames"]


@dataclass(frozen=True)
class StepRows:
    """Planned paths of feet, and when they stand.

    positions: (R, F, 3), m. down: (R, F).
    """

    positions: Annotated[Floats, "rows frames 3"]
    down: Rows


def plan_paths(feet: FootRows, down: Rows) -> StepRows:
    """Return the paths of feet that stand in the frames `down` (R, F)."""
    stances = stance_rows.runs(down)
    predicted, heights = floor_plane.project(feet.positions), feet.heights
    held = _held(stances, feet, down.shape[1])
    floor = smooth_change(predicted, held, _means(predicted, held), feet.rate)
    level = smooth_change(heights, stances, feet.height[stances.rows], feet.rate)
    added, least = _lifts(floor, level, stance_rows.runs(~down), feet)
    level = np.maximum(level + added, feet.height[:, None] + least)
    return StepRows(floor_plane.at_height(floor, level), down)


def smooth_change(
    paths: Annotated[Numbers, "rows frames"],
    stances: Runs,
    values: Annotated[Numbers, "runs"],
    rate: float,
) -> Annotated[Numbers, "rows frames"]:
    """Return the paths (R, F) of smoothest change that have given values in their stances."""
    run, frames = stances.frames()
    rows = stances.rows[run]
    standing = stances.mask(paths.shape)
    change = np.zeros_like(paths)
    change[rows, frames] = values[run] - paths[rows, frames]
    for part in _parts(stance_rows.runs(~standing), paths.shape[1], rate):
        _fill(change, part, rate)
    found: Numbers = paths + change
    found[rows, frames] = values[run]
    return found


@dataclass(frozen=True)
class _Swings:
    """Swings, and whether a stance is before each of them, and after it."""

    runs: Runs
    led: Annotated[Booleans, "runs"]
    trailed: Annotated[Booleans, "runs"]


def _parts(swings: Runs, frames: int, rate: float) -> list[_Swings]:
    """Return swings that are solved alone; a long one is two, as the change fades between them."""
    most = round(FADING * rate)
    long = swings.lengths > 2 * most
    led, trailed = swings.begins > 0, swings.ends < frames
    first, last = swings.select(long & led), swings.select(long & trailed)
    first = Runs(first.rows, first.begins, first.begins + most)
    last = Runs(last.rows, last.ends - most, last.ends)
    return [
        _Swings(swings.select(~long), led[~long], trailed[~long]),
        _Swings(first, np.ones(len(first.rows), bool), np.zeros(len(first.rows), bool)),
        _Swings(last, np.zeros(len(last.rows), bool), np.ones(len(last.rows), bool)),
    ]


def _fill(change: Annotated[Numbers, "rows frames"], swings: _Swings, rate: float) -> None:
    """Fill in the changes of swings; a swing without a stance at its ends has none."""
    frames = change.shape[1]
    keys = np.stack([swings.runs.lengths, swings.led, swings.trailed], axis=1)
    for length, led, trailed in np.unique(keys, axis=0).tolist():
        own = swings.runs.select((keys == (length, led, trailed)).all(axis=1))
        outside = np.stack([own.begins - 2, own.begins - 1, own.ends, own.ends + 1], axis=1)
        known = change[own.rows[:, None], np.clip(outside, 0, frames - 1)]
        matrix = _response(length, rate, bool(led), bool(trailed))
        # Not a matrix product, whose sums could go in another order for more walkers.
        filled = sum(known[:, side, None] * matrix[:, side] for side in range(4))
        change[own.rows[:, None], own.begins[:, None] + np.arange(length)] = filled


@lru_cache(LENGTHS)
def _response(length: int, rate: float, led: bool, trailed: bool) -> Annotated[Floats, "length 4"]:
    """Return the changes of a swing for unit changes of the two frames before and after it.

    led, trailed: whether there are frames before it and after it; zeros where not.
    """
    # Second differences of three frames each, from the first frame of each on.
    firsts = np.arange(0 if led else 2, length + 2 if trailed else length)
    bands, factors = np.zeros((3, length + 4)), (1.0, -2.0, 1.0)
    for row, one in enumerate(factors):
        for column, other in enumerate(factors[: row + 1]):
            bands[row - column, firsts + column] += one * other * (SPREAD * rate) ** 4
    goal = np.zeros((length, 4))
    goal[0, :2] = -bands[2, 0], -bands[1, 1]
    goal[-1, 2:] = -bands[1, length + 1], -bands[2, length + 1]
    if length > 1:
        goal[1, 1], goal[-2, 2] = -bands[2, 1], -bands[2, length]
    bands[0] += 1.0
    return _solve_banded(bands[:, 2:-2], goal)


def _solve_banded(
    bands: Annotated[Floats, "3 length"], goal: Annotated[Floats, "length 4"]
) -> Annotated[Floats, "length 4"]:
    """Return the solution of a symmetric system of five diagonals, by its factors L D L'.

    bands: the diagonal, and the two below it, by column.
    """
    middle, first, second = (band.tolist() for band in bands)
    found = goal.copy()
    for row in range(len(found)):
        if row > 0:
            found[row] -= first[row - 1] * found[row - 1]
        if row > 1:
            found[row] -= second[row - 2] * found[row - 2]
        near, far = first[row], second[row]
        first[row], second[row] = near / middle[row], far / middle[row]
        if row + 1 < len(found):
            middle[row + 1] -= near * first[row]
            first[row + 1] -= far * first[row]
        if row + 2 < len(found):
            middle[row + 2] -= far * second[row]
    found /= np.array(middle)[:, None]
    for row in range(len(found) - 2, -1, -1):
        found[row] -= first[row] * found[row + 1]
        if row + 2 < len(found):
            found[row] -= second[row] * found[row + 2]
    return found


def _held(stances: Runs, feet: FootRows, frames: int) -> Runs:
    """Return the stances with the ends of the swings in which the foot keeps its place."""
    hold = round(HOLD * feet.rate)
    gaps = np.zeros(len(stances.rows) + 1, np.int64)
    near = stances.rows[1:] == stances.rows[:-1]
    gaps[1:-1] = np.where(near, stances.begins[1:] - stances.ends[:-1], 0)
    longer = np.minimum(hold, gaps // 4)
    return Runs(stances.rows, stances.begins - longer[:-1], stances.ends + longer[1:])


def _means(
    paths: Annotated[FloorVectors, "rows frames"], stances: Runs
) -> Annotated[FloorVectors, "runs"]:
    """Return the mean places in stances."""
    # From each row's start, so that sums stay small.
    gone = np.cumsum(paths - paths[:, :1], axis=1)
    gone = np.pad(gone, ((0, 0), (1, 0)))
    sums = gone[stances.rows, stances.ends] - gone[stances.rows, stances.begins]
    found: FloorVectors = paths[stances.rows, 0] + sums / stances.lengths
    return found


def _lifts(
    floor: Annotated[FloorVectors, "rows frames"], level: Heights, swings: Runs, feet: FootRows
) -> tuple[Heights, Heights]:
    """Return how much swinging feet are lifted (R, F), m, and their least height above the floor.

    As for one foot: a foot whose prediction is lifted as captured feet are is not lifted more.
    """
    count = floor.shape[1]
    added, lowest = np.zeros(floor.shape), np.zeros(floor.shape)
    swings = swings.select((swings.begins > 0) | (swings.ends < count))
    if not len(swings.rows):
        return added, lowest
    run, frames = swings.frames()
    rows = swings.rows
    ends = np.maximum(swings.begins - 1, 0), np.minimum(swings.ends, count - 1)
    step = np.abs(floor[rows, ends[1]] - floor[rows, ends[0]])
    least = feet.clearance[rows] * np.minimum(step / FULL_STEP, 1.0)
    highest = np.where(swings.inner(count), highest_lift(swings.lengths / feet.rate), np.inf)
    least = np.minimum(least, highest)
    share, whole = _shares(swings, count, feet)
    rise = lift_shares(share, whole / feet.rate)
    starts = np.cumsum(swings.lengths) - swings.lengths
    top = np.maximum.reduceat(rise, starts)
    height = np.maximum.reduceat(level[rows[run], frames], starts) - feet.height[rows]
    extra = np.maximum(least * top - np.maximum(height, 0.0), 0.0)
    added[rows[run], frames] = extra[run] * rise
    lowest[rows[run], frames] = np.minimum(least, LEAST_LIFT)[run] * rise
    return added, lowest


def _shares(
    swings: Runs, count: int, feet: FootRows
) -> tuple[Annotated[Floats, "frames"], Annotated[Indices, "frames"]]:
    """Return the shares of swings at their frames, 0 to 1, and the steps of time of the swings.

    A swing at an end of a motion goes on outside it, for the usual duration.
    """
    run, frames = swings.frames()
    leads, inner = swings.begins == 0, swings.inner(count)
    usual = np.round(feet.swing[swings.rows] * feet.rate).astype(np.int64)
    whole = 1 + np.where(inner, swings.lengths, np.maximum(swings.lengths, usual))
    steps = frames - swings.begins[run] + 1.0
    found: Floats = (steps + ((whole - 1 - swings.lengths) * leads)[run]) / whole[run]
    return found, whole[run]
