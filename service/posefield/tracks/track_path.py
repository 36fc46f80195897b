"""Paths of people over even frames, from the samples of their tracks.

Between samples a path is a cubic without overshoot, so a person who stops does not swing beyond the
place. It is averaged with a kernel that keeps parabolas: noise goes, and starts, stops and curves
of walkers stay. At a corner at constant speed a person slows down, cuts it, and catches up. Where
velocities still change as no walker's do, it is averaged over longer. The distance is told.
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from posefield.common.units import Floats, Frames
from posefield.locomotion.floor_plane import FloorVectors, smooth
from posefield.motion import quat
from posefield.performance import step_plan
from posefield.tracks.track import Track

WINDOW, LONG_WINDOW = 0.18, 0.4
"""Standard deviations of the averages, s."""
MOST_ACCELERATION = 7.0
"""Acceleration from which on a path is averaged over the longer window, m/s²."""
SPREAD = 0.3
"""Time over which the longer window is blended in, s."""
MOVING, CREEPING = 0.25, 0.05
"""Speed from which on a person has a direction of travel, m/s, and mean speed: noise has less."""
TRAVEL_SPEED = (0.35, 0.5)
"""Speeds between which a person turns from a stated heading to the direction of travel, m/s."""
HEADING_WINDOW = 0.2
"""Standard deviation of the average of headings, s."""


@dataclass(frozen=True)
class TrackPath:
    """Path of one person in F frames.

    first: frame of the clock that all people share. points: (F,), m. velocities: (F,), m/s.
    headings: of the body (F,), rad, without jumps. errors: distances from the track (F,), m.
    """

    first: int
    points: Annotated[FloorVectors, "frames"]
    velocities: Annotated[FloorVectors, "frames"]
    headings: Frames
    errors: Frames

    def __len__(self) -> int:
        """Return the number of frames."""
        return len(self.points)


def follow(track: Track, origin: float, rate: float) -> TrackPath | None:
    """Return the path of a track at frames `origin + k / rate`, s; None for fewer than two."""
    first = int(np.ceil((track.times[0] - origin) * rate - 1e-4))  # Times since 1970 are coarse.
    last = int(np.floor((track.times[-1] - origin) * rate + 1e-4))
    if last <= first:
        return None
    times = origin + np.arange(first, last + 1) / rate
    stated = _interpolate(track.times, track.points, times)
    points = smooth(stated, WINDOW * rate, sharp=True)
    beyond = np.abs(np.gradient(np.gradient(points))) * rate**2 > MOST_ACCELERATION
    if beyond.any():
        longer = smooth(stated, LONG_WINDOW * rate)
        near = np.convolve(beyond, np.ones(2 * int(LONG_WINDOW * rate) + 1), "same") > 0.0
        share = smooth(near.astype(complex), SPREAD * rate, fixed=False).real
        points = points + np.clip(share, 0.0, 1.0) * (longer - points)
    velocities = np.gradient(points) * rate
    headings = _headings(track, times, velocities, rate)
    return TrackPath(first, points, velocities, headings, np.abs(points - stated))


def _interpolate(
    times: Annotated[Floats, "samples"], points: Annotated[FloorVectors, "samples"], at: Frames
) -> Annotated[FloorVectors, "frames"]:
    """Return the monotone cubic (Fritsch and Butland 1984) through samples at times (F,)."""
    steps = np.diff(times)
    slopes = np.diff(points) / steps
    inner = np.zeros((2, max(len(slopes) - 1, 0)))
    for row, values in zip(inner, (slopes.real, slopes.imag), strict=True):
        before, after = values[:-1], values[1:]
        weights = 2.0 * steps[1:] + steps[:-1], steps[1:] + 2.0 * steps[:-1]
        with np.errstate(divide="ignore", invalid="ignore"):
            mean = sum(weights) / (weights[0] / before + weights[1] / after)
        row[:] = np.where(before * after > 0.0, mean, 0.0)
    tangents = np.concatenate([slopes[:1], inner[0] + 1j * inner[1], slopes[-1:]])
    piece = np.clip(np.searchsorted(times, at, "right") - 1, 0, len(steps) - 1)
    step = steps[piece]
    share = np.clip((at - times[piece]) / step, 0.0, 1.0)
    bend = share * (1.0 - share)
    rise = share * share * (3.0 - 2.0 * share)
    curve = bend * (1.0 - share) * tangents[piece] - bend * share * tangents[piece + 1]
    return np.asarray(points[piece] + rise * (points[piece + 1] - points[piece]) + step * curve)


def _headings(
    track: Track, times: Frames, velocities: Annotated[FloorVectors, "frames"], rate: float
) -> Frames:
    """Return headings of the body (F,), rad: of travel, as stated at low speed, or in between."""
    speeds = np.abs(velocities)
    if track.headings is not None:
        stated = np.exp(1j * np.interp(times, track.times, np.unwrap(track.headings)))
        low, high = TRAVEL_SPEED
        share = quat.smoothstep(np.clip((speeds - low) / (high - low), 0.0, 1.0))
        ways = velocities / np.maximum(speeds, 1e-9)
        headings = np.unwrap(np.angle(share * ways + (1.0 - share) * stated))
    else:
        # Beside a pause, moves do not make creeping of it.
        slow = np.where(speeds > MOVING, 0.0, velocities)
        slow = smooth(slow, step_plan.SLOW_WINDOW * rate, fixed=False)
        creeps = (speeds <= MOVING) & (np.abs(slow) > CREEPING)
        ways = np.where(creeps, slow, velocities)
        headings = _travel_headings(ways, creeps | (speeds > MOVING), rate)
    return smooth(headings.astype(complex), HEADING_WINDOW * rate, sharp=True, fixed=False).real


def _travel_headings(
    velocities: Annotated[FloorVectors, "frames"], moving: np.ndarray, rate: float
) -> Frames:
    """Return the directions of travel (F,), rad; who stands turns before setting off."""
    if not moving.any():
        return np.full(len(velocities), np.angle(velocities.sum()))
    rows = np.flatnonzero(moving)
    directions = np.unwrap(np.angle(velocities[rows]))
    headings = np.interp(np.arange(len(velocities)), rows, directions)
    gaps = np.flatnonzero(np.diff(rows) > 1)
    for begin, end, before, after in zip(
        rows[gaps], rows[gaps + 1], directions[gaps], directions[gaps + 1], strict=True
    ):
        longest = step_plan.turn_seconds(after - before) * rate
        start = max(float(begin), end - longest)
        share = quat.smoothstep(np.clip((np.arange(begin, end) - start) / (end - start), 0.0, 1.0))
        headings[begin:end] = before + share * (after - before)
    return headings
