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

from posefield.common.units import Booleans, Floats
from posefield.feet import stance_rows
from posefield.feet.ball_path import FULL_STEP, HOLD, LEAST_LIFT, LIFT_EXPONENT, SPREAD, Numbers
from posefield.feet.stance_rows import FootRows, Rows, Runs
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
    bends = np.diff(np.eye(length + 4), n=2, axis=0)
    bends = bends[0 if led else 2 : None if trailed else length]
    inside, outside = bends[:, 2:-2], bends[:, [0, 1, -2, -1]]
    stiffness = (SPREAD * rate) ** 4
    matrix = np.eye(length) + stiffness * inside.T @ inside
    found = np.empty((length, 4))
    found[:] = np.linalg.solve(matrix, -stiffness * inside.T @ outside)
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
    rise = np.sin(np.pi * _shares(swings, count, feet)) ** LIFT_EXPONENT
    starts = np.cumsum(swings.lengths) - swings.lengths
    top = np.maximum.reduceat(rise, starts)
    height = np.maximum.reduceat(level[rows[run], frames], starts) - feet.height[rows]
    extra = np.maximum(least * top - np.maximum(height, 0.0), 0.0)
    added[rows[run], frames] = extra[run] * rise
    lowest[rows[run], frames] = np.minimum(least, LEAST_LIFT)[run] * rise
    return added, lowest


def _shares(swings: Runs, count: int, feet: FootRows) -> Annotated[Floats, "frames"]:
    """Return the shares of swings at their frames, 0 to 1, swing after swing.

    A swing at an end of a motion goes on outside it, for the usual duration.
    """
    run, frames = swings.frames()
    leads, inner = swings.begins == 0, swings.inner(count)
    usual = np.round(feet.swing[swings.rows] * feet.rate).astype(np.int64)
    whole = 1 + np.where(inner, swings.lengths, np.maximum(swings.lengths, usual))
    steps = frames - swings.begins[run] + 1.0
    found: Floats = (steps + ((whole - 1 - swings.lengths) * leads)[run]) / whole[run]
    return found
