"""Paths of the joints that contact: the smoothest changes of the predicted paths that stand.

The change over the floor is that of `smooth_change`: a thin-plate prior on the change, conditioned
on standing. Heights have the same change with given heights of stances, and swings are lifted.
"""

from typing import Annotated

import numpy as np

from posefield.common.frame_groups import FrameGroups
from posefield.common.units import UP, Floats, Frames, Indices
from posefield.feet import stance_rows
from posefield.feet.smooth_change import smooth_change
from posefield.feet.stance_rows import UNEVEN, FootRows, Mask, PerRun, Runs
from posefield.locomotion import floor_plane
from posefield.locomotion.floor_plane import FloorVectors

# A foot keeps its place over the floor for this time before and after a swing, while it is low, s.
HOLD = 0.05
# Step from which on a swing is lifted to the full clearance, m.
FULL_STEP = 0.1
# A foot leaves the floor, and comes back to it, over this time, s: the knee of a straight leg moves
# several times as fast as its foot is lifted. The exponent of the lift between both.
RISE, LIFT_EXPONENT = 0.09, 0.2
# A foot in the middle of a full step is at least this high above its place, m.
LEAST_LIFT = 0.025
# Mean acceleration of a lift, m/s²: a short swing is not lifted as high as a captured one.
LIFT_ACCELERATION = 12.0


def plan_paths(
    feet: FootRows,
    stances: Runs,
    goal: Annotated[Floats, "frames 3"],
) -> Annotated[Floats, "frames 3"]:
    """Return the paths (N, 3), m, of feet that stand in the runs `stances`.

    goal: points (N, 3), m, that the paths go through; not a number in other frames.
    """
    led = ~np.isnan(goal[:, 0])
    over, up = (floor_plane.project(goal), goal @ UP) if led.any() else (None, None)
    floor = smooth_change(feet, feet.floor, held(feet, stances, led), fixed=over)
    heights = smooth_change(feet, feet.heights, stances, feet.height[stances.rows], up)
    added, lowest = lifts(feet, floor, heights, stances, goal @ UP)
    standing_heights = feet.height[feet.rows.groups.group]
    return floor_plane.at_height(floor, np.maximum(heights + added, standing_heights + lowest))


def lifts(
    feet: FootRows,
    floor: Annotated[FloorVectors, "frames"],
    heights: Annotated[Floats, "frames"],
    stances: Runs,
    led: Annotated[Floats, "frames"],
) -> tuple[Annotated[Floats, "frames"], Annotated[Floats, "frames"]]:
    """Return how much swinging feet are lifted (N,), m, and their least heights (N,) in swings.

    floor, heights: paths (N,) without lifts. led: heights (N,), m, of points to which feet are led;
    not a number in other frames. Such a point ends a swing. A foot whose prediction is lifted as
    captured feet are is not lifted more. Zero in stances, or less where a foot is led below the
    floor.
    """
    rows = feet.rows
    added = np.zeros(len(floor))
    lowest = _led_heights(feet, stances, led)
    ended = stances.mask(rows) | ~np.isnan(led)
    swings = stance_rows.runs(~ended, rows)
    # Those with a stance before or after them.
    swings = swings.select(swings.lengths < rows.counts[swings.rows])
    if not len(swings.rows):
        return added, lowest
    run, frames = swings.frames()
    flat, groups = rows.flat(swings.rows[run], frames), FrameGroups(swings.lengths)
    outer_frames = _ends(swings, feet)
    first, last = (lowest[rows.flat(swings.rows, end)] for end in outer_frames)
    begin, end = (stance_rows.places(feet, floor, swings.rows, edge) for edge in outer_frames)
    smallest_lift = feet.clearance[swings.rows] * np.minimum(np.abs(end - begin) / FULL_STEP, 1.0)
    # A parabola: how high a foot is lifted at most in the duration of its swing.
    highest = LIFT_ACCELERATION * (swings.lengths / rows.rates[swings.rows]) ** 2 / 8.0
    smallest_lift = np.where(swings.inner(rows), np.minimum(smallest_lift, highest), smallest_lift)
    smallest_lift = np.where(np.minimum(first, last) < -UNEVEN, 0.0, smallest_lift)
    share, durations = _shares(swings, feet)
    rise = _lift_shares(share, durations[run] / rows.rates[swings.rows[run]])
    lifted = np.maximum(groups.largest(heights[flat]) - feet.height[swings.rows], 0.0)
    extra = np.maximum(smallest_lift * groups.largest(rise) - lifted, 0.0)
    added[flat] = extra[run] * rise
    between = first[run] + share * (last - first)[run]
    lowest[flat] = np.minimum(smallest_lift, LEAST_LIFT)[run] * rise + between
    return added, lowest


def _led_heights(
    feet: FootRows, stances: Runs, led: Annotated[Floats, "frames"]
) -> Annotated[Floats, "frames"]:
    """Return how far below their heights feet are led (N,), m: in a stance in all of its frames."""
    height = feet.height[feet.rows.groups.group]
    lowest = np.fmin(led - height, 0.0)
    if lowest.any():
        run, frames = stances.frames()
        flat = feet.rows.flat(stances.rows[run], frames)
        lowest[flat] = FrameGroups(stances.lengths).smallest(lowest[flat])[run]
    return lowest


def _shares(swings: Runs, feet: FootRows) -> tuple[Annotated[Floats, "frames"], PerRun]:
    """Return the shares of swings at their frames, 0 to 1, and the steps from stance to stance.

    A swing at an end of a clip goes on outside it, for the usual duration.
    """
    rows = feet.rows
    usual_lengths = np.round((feet.swing * rows.rates)[swings.rows]).astype(np.int64)
    inner = swings.inner(rows)
    durations = 1 + np.where(inner, swings.lengths, np.maximum(swings.lengths, usual_lengths))
    leads = (swings.begins == 0) & ~inner
    run, frames = swings.frames()
    steps = frames - swings.begins[run] + 1.0
    shares: Floats = (steps + ((durations - 1 - swings.lengths) * leads)[run]) / durations[run]
    return shares, durations


def _ends(swings: Runs, feet: FootRows) -> tuple[PerRun, PerRun]:
    """Return the frames in which feet stand before and after swings, or the clips' ends."""
    counts, cyclic = feet.rows.counts[swings.rows], feet.rows.cyclic[swings.rows]
    after = np.where(cyclic & (swings.begins == 0), counts, 0)
    first_frames, last_frames = swings.begins - 1 + after, swings.ends + after
    return (
        np.where(cyclic, first_frames, np.maximum(first_frames, 0)),
        np.where(cyclic, last_frames, np.minimum(last_frames, counts - 1)),
    )


def held(feet: FootRows, stances: Runs, led: Mask) -> Runs:
    """Return the stances with the ends of the swings in which the foot keeps its place.

    A point to which it is led ends a swing.
    """
    rows = feet.rows
    counts, cyclic = rows.counts[stances.rows], rows.cyclic[stances.rows]
    hold = np.round(HOLD * rows.rates[stances.rows]).astype(np.int64)
    gaps = _gaps(stances, feet)
    before, after = (
        np.minimum(hold, np.minimum(gap, far) // 4)
        for gap, far in zip(gaps, _led_distances(stances, feet, led), strict=True)
    )
    first_frames, last_frames = stances.begins - before, stances.ends + after
    lengths = np.minimum(last_frames - first_frames, counts)
    first_frames = np.where(cyclic, first_frames % counts, np.maximum(first_frames, 0))
    return Runs(
        stances.rows,
        first_frames,
        np.where(cyclic, first_frames + lengths, np.minimum(last_frames, counts)),
    )


def _gaps(stances: Runs, feet: FootRows) -> tuple[Indices, Indices]:
    """Return the numbers of frames from the stance before to each, and from each to the next.

    Zero to an end of a motion that does not repeat.
    """
    rows, many = stances.rows, len(stances.rows)
    number = np.bincount(rows, minlength=len(feet.rows.counts))
    start = (np.cumsum(number) - number)[rows]
    index = np.arange(many) - start
    following = start + (index + 1) % number[rows]
    cyclic = feet.rows.cyclic[rows]
    after = (stances.begins[following] - stances.ends) % feet.rows.counts[rows]
    after = np.where(cyclic | (index + 1 < number[rows]), after, 0)
    before = np.zeros(many, np.int64)
    before[following] = after
    return before, after


def _led_distances(stances: Runs, feet: FootRows, led: Mask) -> tuple[Indices, Indices]:
    """Return the numbers of frames between each stance and the led frames before and after it."""
    far = len(led)
    frames = np.flatnonzero(led)
    if not len(frames):
        return (np.full(len(stances.rows), far),) * 2
    start = feet.rows.groups.starts[stances.rows]
    first_frames, last_frames = start + stances.begins, start + stances.ends
    before = np.searchsorted(frames, first_frames) - 1
    after = np.searchsorted(frames, last_frames)
    last = frames[np.maximum(before, 0)]
    first = frames[np.minimum(after, len(frames) - 1)]
    stop = start + feet.rows.counts[stances.rows]
    return (
        np.where((before >= 0) & (last >= start), first_frames - 1 - last, far),
        np.where((after < len(frames)) & (first < stop), first - last_frames, far),
    )


def _lift_shares(share: Frames, seconds: float | Frames) -> Frames:
    """Return the shares (S,) of a lift at shares of swings that last some seconds.

    The foot leaves the floor, and comes to it, at rest.
    """
    quickest = np.maximum(seconds / RISE, 2.0)
    soon = np.minimum(np.minimum(share, 1.0 - share) * quickest, 1.0)
    lift: Frames = np.sin(np.pi * share) ** LIFT_EXPONENT * soon**2 * (3.0 - 2.0 * soon)
    return lift
