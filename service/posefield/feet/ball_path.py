"""Paths of the joints that contact: the smoothest changes of the predicted paths that stand.

The change over the floor is that of `smooth_change`: a thin-plate prior on the change, conditioned
on standing. Heights have the same change with given heights of stances, and swings are lifted.

Stances begin on the heel: a foot is flat at the pitch above which it is in a quarter of its
standing frames. While the toes are higher than that, the heel keeps its place; from then on the
ball does, until the toes leave the floor. A leg that would be stretched lifts its heel: the foot
turns about its ball. Toes bend where their ends would be below the floor.
"""

from typing import Annotated

import numpy as np

from posefield.common.frame_groups import FrameGroups, FrameRows
from posefield.common.units import UP, Floats, Frames
from posefield.feet import stance_rows
from posefield.feet.limbs import Points, Turns, Values
from posefield.feet.smooth_change import smooth_change
from posefield.feet.stance_rows import SUNK, UNEVEN, FootRows, PerRow, PerRun, Runs
from posefield.locomotion import floor_plane
from posefield.locomotion.floor_plane import FloorVectors
from posefield.motion import contact_detection, quat

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
    rolled, rolled_heights, _ = roll(feet, stances)
    if not np.isnan(goal).all():
        over, up = floor_plane.project(goal) - rolled, goal @ UP - rolled_heights
    # A foot that rolls keeps its place but for the offset of its ball.
    floor = smooth_change(feet, feet.floor - rolled, stances, fixed=over) + rolled
    heights = rolled_heights + smooth_change(
        feet, feet.heights - rolled_heights, stances, feet.height[stances.rows], up
    )
    added, lowest = lifts(feet, floor, heights, stances, goal @ UP)
    lowest += np.minimum(rolled_heights, 0.0)
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
    is_led = ~np.isnan(led)
    lowest = _led_heights(feet, stances, led) if is_led.any() else np.zeros(len(floor))
    ended = stances.mask(rows) | is_led
    swings = stance_rows.runs(~ended, rows)
    # Those with a stance before or after them.
    swings = swings.select(swings.lengths < rows.counts[swings.rows])
    if not len(swings.rows):
        return added, lowest
    run, frames = swings.frames()
    flat, groups = rows.flat(swings.rows[run], frames), FrameGroups(swings.lengths)
    # Frames in which feet stand before and after swings, or the clips' ends.
    counts, cyclic = rows.groups.counts[swings.rows], rows.cyclic[swings.rows]
    later = np.where(cyclic & (swings.begins == 0), counts, 0)
    before, after = swings.begins - 1 + later, swings.ends + later
    outer_frames = (
        np.where(cyclic, before, np.maximum(before, 0)),
        np.where(cyclic, after, np.minimum(after, counts - 1)),
    )
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


def _lift_shares(share: Frames, seconds: float | Frames) -> Frames:
    """Return the shares (S,) of a lift at shares of swings that last some seconds.

    The foot leaves the floor, and comes to it, at rest.
    """
    quickest = np.maximum(seconds / RISE, 2.0)
    soon = np.minimum(np.minimum(share, 1.0 - share) * quickest, 1.0)
    lift: Frames = np.sin(np.pi * share) ** LIFT_EXPONENT * soon**2 * (3.0 - 2.0 * soon)
    return lift


# Percentile of the pitch of standing feet, toes up, at which they are flat.
FLAT = 75.0
# Distance of the heel behind the ankle, as a share of that from the ankle to the ball.
HEEL = 0.4
# A heel is lifted by this angle at most so that a leg reaches, rad.
MOST_LIFT = 0.35


def flat_pitches(vectors: Annotated[Floats, "frames 3"], contacts: Runs, rows: FrameRows) -> PerRow:
    """Return the pitches of vectors of feet (N, 3) while these are flat (R,), rad, toes up.

    Zero without contacts.
    """
    run, frames = contacts.frames()
    row = contacts.rows[run]
    pitches = _pitches(vectors[rows.flat(row, frames)])
    return stance_rows.row_percentiles(pitches, row, len(rows.counts), FLAT)


def _pitches(arms: Annotated[Floats, "values 3"]) -> Annotated[Floats, "values"]:
    """Return the pitches (V,), rad, of vectors from the ankles to the balls (V, 3); toes up."""
    pitches: Floats = np.arctan2(arms @ UP, np.abs(floor_plane.project(arms)))
    return pitches


def roll(
    feet: FootRows, stances: Runs
) -> tuple[Annotated[FloorVectors, "frames"], Annotated[Floats, "frames"], PerRun]:
    """Return how feet roll in stances: the offsets of their balls from where they stand flat.

    Over the floor (N,), and heights (N,), m; zero in swings. Then the first frame of each run in
    which the foot is flat; the end of a run in which it is not. Heights follow the prediction,
    softly, from SUNK below the floor to UNEVEN above it.
    """
    rows = feet.rows
    floor, heights = np.zeros(len(feet.floor), complex), np.zeros(len(feet.floor))
    run, frames = stances.frames()
    row = stances.rows[run]
    flat = rows.flat(row, frames)
    arms, level, height = feet.arms[flat], feet.flat_pitch[row], feet.height[row]
    length, direction = np.linalg.norm(arms, axis=-1), floor_plane.project(arms)
    direction = direction / np.maximum(np.abs(direction), 1e-9)
    toes_up = np.maximum(_pitches(arms) - level, 0.0)
    # The ball from the heel, ahead and up, of a foot whose heel is on the floor.
    ankle, heel = height - length * np.sin(level), HEEL * length * np.cos(level)
    cosine, sine = np.cos(toes_up), np.sin(toes_up)
    ahead = length * np.cos(level + toes_up) + heel * cosine - ankle * sine
    up = length * np.sin(level + toes_up) + heel * sine + ankle * cosine
    above = feet.heights[flat] - height
    # Toes are not lifted above the prediction: it may have been taken for flat on tiptoe.
    rise = np.minimum(up - height, np.maximum(above, 0.0))
    room = np.where(above < rise, SUNK, UNEVEN)
    heights[flat] = rise + room * np.tanh((above - rise) / room)
    flats = stances.ends.copy()
    level_frames = np.flatnonzero(toes_up == 0.0)[::-1]
    flats[run[level_frames]] = frames[level_frames]
    # Vectors of a later cycle are turned.
    turned = np.where(frames >= rows.counts[row], feet.factors[row], 1.0)
    places = ahead * direction * turned
    last = np.cumsum(stances.lengths) - stances.ends + np.minimum(flats, stances.ends - 1)
    rolling = frames < flats[run]
    floor[flat] = np.where(rolling, places - places[last[run]], 0.0) * np.conj(turned)
    return floor, heights, flats


def trimmed(stances: Runs, feet: FootRows) -> Runs:
    """Return stances without the frames at their ends in which ankle and ball move.

    A mean motion leaves the floor, and comes back to it, over a longer time than captured ones do,
    whose median times the contacts have.
    """
    rows = feet.rows
    run, frames = stances.frames()
    row = stances.rows[run]
    ankles = feet.floor - floor_plane.project(feet.arms)
    count, in_cycle = rows.groups.counts[row], rows.cyclic[row]
    before, after = (
        np.where(in_cycle, frame + count, np.clip(frame, 0, count - 1))
        for frame in (frames - 1, frames + 1)
    )
    speeds = []
    for path in (feet.floor, ankles):
        first, second = (stance_rows.places(feet, path, row, frame) for frame in (before, after))
        speeds.append(np.abs(second - first) * rows.rates[row] / np.maximum(after - before, 1))
    still = np.flatnonzero(np.minimum(*speeds) < contact_detection.DEFAULT.grown_speed)
    begins, ends = stances.begins.copy(), stances.ends.copy()
    begins[run[still[::-1]]], ends[run[still]] = frames[still[::-1]], frames[still] + 1
    cyclic, counts = rows.cyclic[stances.rows], rows.counts[stances.rows]
    # What a motion begins or ends with goes on outside it.
    begins = np.where(~cyclic & (stances.begins == 0), 0, begins)
    ends = np.where(~cyclic & (stances.ends == counts), counts, ends)
    later = np.where(begins >= counts, counts, 0)
    return Runs(stances.rows, begins - later, ends - later).sort()


def heel_turns(offset: Points, arm: Points, chord: Values) -> Turns:
    """Return the turns (N, 4) of feet about their balls with which legs reach.

    offset: from the balls to the hips (N, 3), m. arm: from the ankles to the balls (N, 3), m.
    chord: distance (N,), m, that the leg spans.
    """
    foot, distance = np.linalg.norm(arm, axis=-1), np.linalg.norm(offset, axis=-1)
    scale = np.maximum(2.0 * foot * distance, 1e-12)
    intended = (np.square(distance) + np.square(foot) - np.square(chord)) / scale
    present = -2.0 * np.sum(arm * offset, axis=-1) / scale
    angle = np.arccos(np.clip(present, -1.0, 1.0)) - np.arccos(np.clip(intended, -1.0, 1.0))
    axis = quat.cross(offset, arm)
    axis /= np.maximum(np.linalg.norm(axis, axis=-1, keepdims=True), 1e-12)
    return quat.exp(axis * np.clip(angle, -MOST_LIFT, MOST_LIFT)[:, None])


def toe_bends(toe: Points, lowest: Annotated[Floats, "frames"]) -> Turns:
    """Return the turns (N, 4) of toes with which their ends are no lower than wanted.

    toe: from the balls to the ends of the toes (N, 3), m. lowest: heights of the ends above the
    balls (N,), m.
    """
    size = np.linalg.norm(toe, axis=-1)
    sines = np.clip(np.stack([toe @ UP, lowest]) / np.maximum(size, 1e-9), -1.0, 1.0)
    present, intended = np.arcsin(sines)
    axis = quat.cross(toe, np.broadcast_to(UP, toe.shape))
    axis /= np.maximum(np.linalg.norm(axis, axis=-1, keepdims=True), 1e-9)
    return quat.exp(axis * np.maximum(intended - present, 0.0)[:, None])
