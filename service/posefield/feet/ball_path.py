"""Paths of the joints that contact: the smoothest changes of the predicted paths that stand.

The change over the floor is that of `smooth_change`: a thin-plate prior on the change, conditioned
on standing. Heights have the same change with given heights of stances, and swings are lifted.
"""

from typing import Annotated

import numpy as np

from posefield.common.frame_groups import FrameGroups
from posefield.common.units import UP, Floats, Frames
from posefield.feet import heel_roll, stance_rows
from posefield.feet.smooth_change import smooth_change
from posefield.feet.stance_rows import UNEVEN, FootRows, PerRun, Runs
from posefield.locomotion import floor_plane
from posefield.locomotion.floor_plane import FloorVectors

# A swing is lifted to this share of the captured clearance, which is that of high swings, and to
# less for a step of less, m.
LIFT_SHARE, FULL_STEP = 0.5, 0.1
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
    """Return the paths (N, 3), m, of feet that stand in the runs `stances`, and roll there.

    goal: points (N, 3), m, that the paths go through; not a number in other frames.
    """
    over = up = None
    roll = heel_roll.roll(feet, stances)
    if not np.isnan(goal).all():
        over, up = floor_plane.project(goal) - roll.floor, goal @ UP - roll.heights
    # A foot that rolls keeps its place but for the offset of its ball.
    floor = smooth_change(feet, feet.floor - roll.floor, stances, fixed=over) + roll.floor
    heights = roll.heights + smooth_change(
        feet, feet.heights - roll.heights, stances, feet.height[stances.rows], up
    )
    added, lowest = lifts(feet, floor, heights, stances, goal @ UP)
    lowest += np.minimum(roll.heights, 0.0)
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
    smallest_lift = (
        LIFT_SHARE * feet.clearance[swings.rows] * np.minimum(np.abs(end - begin) / FULL_STEP, 1.0)
    )
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


def _lift_shares(share: Frames, seconds: float | Frames) -> Frames:
    """Return the shares (S,) of a lift at shares of swings that last some seconds.

    The foot leaves the floor, and comes to it, at rest.
    """
    quickest = np.maximum(seconds / RISE, 2.0)
    soon = np.minimum(np.minimum(share, 1.0 - share) * quickest, 1.0)
    lift: Frames = np.sin(np.pi * share) ** LIFT_EXPONENT * soon**2 * (3.0 - 2.0 * soon)
    return lift
