"""Rolling feet: stances that begin on the heel, and heels that leave the floor so that legs reach.

A foot is flat at the pitch above which it is in a quarter of its standing frames. While the toes
are higher than that, the heel keeps its place; from then on the ball does, until the toes leave the
floor. A leg that would be stretched lifts its heel: the foot turns about its ball. Toes bend where
their ends would be below the floor.
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from posefield.common.frame_groups import FrameRows
from posefield.common.units import UP, Floats
from posefield.feet import stance_rows
from posefield.feet.limbs import Points, Turns, Values
from posefield.feet.stance_rows import SUNK, UNEVEN, FootRows, PerRow, PerRun, Runs
from posefield.locomotion import floor_plane
from posefield.locomotion.floor_plane import FloorVectors
from posefield.motion import contact_detection, quat

# Percentile of the pitch of standing feet, toes up, at which they are flat.
FLAT = 75.0
# Distance of the heel behind the ankle, as a share of that from the ankle to the ball.
HEEL = 0.4
# A heel is lifted by this angle at most so that a leg reaches, rad.
MOST_LIFT = 0.35


@dataclass(frozen=True)
class Roll:
    """Offsets of the balls of feet in stances from where they stand flat.

    floor, heights: (N,), m; zero in swings. flats: first frame of each run in which the foot is
    flat; the end of a run in which it is not.
    """

    floor: Annotated[FloorVectors, "frames"]
    heights: Annotated[Floats, "frames"]
    flats: PerRun


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


def roll(feet: FootRows, stances: Runs) -> Roll:
    """Return how feet roll in stances.

    Heights follow the prediction, softly, from SUNK below the floor to UNEVEN above it.
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
    return Roll(floor, heights, flats)


def trimmed(stances: Runs, feet: FootRows) -> Runs:
    """Return stances without the frames at their ends in which ankle and ball move.

    A mean motion leaves the floor, and comes back to it, over a longer time than captured ones do,
    whose median times the contacts have.
    """
    rows = feet.rows
    run, frames = stances.frames()
    row = stances.rows[run]
    ankles = feet.floor - floor_plane.project(feet.arms)
    speeds = [_speeds(path, feet, row, frames) for path in (feet.floor, ankles)]
    still = np.flatnonzero(np.minimum(*speeds) < contact_detection.DEFAULT.grown_speed)
    begins, ends = stances.begins.copy(), stances.ends.copy()
    begins[run[still[::-1]]], ends[run[still]] = frames[still[::-1]], frames[still] + 1
    cyclic, counts = rows.cyclic[stances.rows], rows.counts[stances.rows]
    # What a motion begins or ends with goes on outside it.
    begins = np.where(~cyclic & (stances.begins == 0), 0, begins)
    ends = np.where(~cyclic & (stances.ends == counts), counts, ends)
    later = np.where(begins >= counts, counts, 0)
    return Runs(stances.rows, begins - later, ends - later).sort()


def _speeds(
    path: Annotated[FloorVectors, "frames"], feet: FootRows, row: PerRun, frames: PerRun
) -> Annotated[Floats, "runs"]:
    """Return the speeds (V,), m/s, of paths (N,) of rows (V,) at frames (V,)."""
    counts, cyclic = feet.rows.counts[row], feet.rows.cyclic[row]
    before, after = (
        np.where(cyclic, frame + counts, np.clip(frame, 0, counts - 1))
        for frame in (frames - 1, frames + 1)
    )
    first, second = (stance_rows.places(feet, path, row, frame) for frame in (before, after))
    speeds: Floats = np.abs(second - first) * feet.rows.rates[row] / np.maximum(after - before, 1)
    return speeds


def heel_turns(offset: Points, arm: Points, chord: Values) -> Turns:
    """Return the turns (N, 4) of feet about their balls with which legs reach.

    offset: from the balls to the hips (N, 3), m. arm: from the ankles to the balls (N, 3), m.
    chord: distance (N,), m, that the leg spans.
    """
    foot, distance = np.linalg.norm(arm, axis=-1), np.linalg.norm(offset, axis=-1)
    scale = np.maximum(2.0 * foot * distance, 1e-12)
    wanted = (np.square(distance) + np.square(foot) - np.square(chord)) / scale
    present = -2.0 * np.sum(arm * offset, axis=-1) / scale
    angle = np.arccos(np.clip(present, -1.0, 1.0)) - np.arccos(np.clip(wanted, -1.0, 1.0))
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
    present, wanted = np.arcsin(sines)
    axis = quat.cross(toe, np.broadcast_to(UP, toe.shape))
    axis /= np.maximum(np.linalg.norm(axis, axis=-1, keepdims=True), 1e-9)
    return quat.exp(axis * np.maximum(wanted - present, 0.0)[:, None])
