"""Detection of a foot's contacts with the ground, from its speed and height with hysteresis.

A contact is a run of frames that are slow and low, of which one at least is slower and lower still.
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from posefield.common.bounded_types import Index, NonNegative, Number, Positive
from posefield.common.units import UP, Booleans, Floats, Indices

LONG_SWING, CLEARANCE = 90.0, 75.0
"""Percentiles of a swing's duration and of its lift that count as its longest, and as its
clearance."""


@dataclass(frozen=True)
class FootContact:
    """A joint that contacts the ground, and how its swings are in the captured clips.

    joint: index. height: of the joint while it stands, m. swing: median duration of a swing, s.
    longest_swing: 90th percentile of the durations, s. clearance: height by which the joint is
    lifted in a swing, 75th percentile, m.
    """

    joint: Index
    height: Number
    swing: Positive
    longest_swing: Positive
    clearance: NonNegative


@dataclass(frozen=True)
class ContactThresholds:
    """Thresholds of contacts.

    speed, height: below which a contact begins, m/s and m. grown_speed, grown_height: below which
    it goes on. shortest: of a contact, s. shortest_gap: between two contacts, s. smoothing:
    standard deviation of the Gaussian over the speed, s. ground: percentile of the foot's heights
    above which its height is measured.
    """

    speed: float = 0.20
    height: float = 0.035
    grown_speed: float = 0.45
    grown_height: float = 0.0525
    shortest: float = 0.1
    shortest_gap: float = 0.08
    smoothing: float = 0.012
    ground: float = 2.0


DEFAULT = ContactThresholds()
SMOOTHING_REACH = 4.0
"""Standard deviations at which the Gaussian is cut off."""


def detect_contacts(
    path: Annotated[Floats, "frames 3"],
    rate: float,
    cyclic: bool,
    moving_ground: Annotated[Floats, "3"] | None = None,
    thresholds: ContactThresholds = DEFAULT,
) -> Annotated[Booleans, "frames"]:
    """Return True (F,) for the frames of a path (F, 3), m, in which a foot contacts the ground.

    rate: frames a second. cyclic: the frames are one cycle, and the last leads into the first:
    frame F - 1 is frame 0 of the next cycle. moving_ground: velocity of the ground, m/s, for a
    motion whose travel was removed.
    """
    speeds = _speeds(path, rate, cyclic, moving_ground, thresholds.smoothing)
    heights = path @ UP - np.percentile(path @ UP, thresholds.ground)
    if cyclic:
        heights = heights[:-1]
    possible = (speeds < thresholds.grown_speed) & (heights < thresholds.grown_height)
    certain = (speeds < thresholds.speed) & (heights < thresholds.height)
    contacts = tidy_contacts(_grow(certain, possible, cyclic), rate, cyclic, thresholds)
    return np.append(contacts, contacts[0]) if cyclic else contacts


def tidy_contacts(
    contacts: Annotated[Booleans, "frames"],
    rate: float,
    cyclic: bool,
    thresholds: ContactThresholds = DEFAULT,
) -> Annotated[Booleans, "frames"]:
    """Return contacts (F,) without short ones, and with short gaps between two of them closed.

    A cycle is given without its last frame.
    """
    tidied = contacts.copy()
    for run in runs(contacts, cyclic):
        if len(run) < thresholds.shortest * rate:
            tidied[run] = False
    for run in runs(~tidied, cyclic):
        inside = tidied.any() and (cyclic or (run[0] > 0 and run[-1] < len(tidied) - 1))
        if inside and len(run) < thresholds.shortest_gap * rate:
            tidied[run] = True
    return tidied


def runs(mask: Annotated[Booleans, "frames"], cyclic: bool) -> list[Annotated[Indices, "_"]]:
    """Return the indices of each run of True in a mask (F,), in order.

    cyclic: a run goes on from the last frame to the first.
    """
    count = len(mask)
    if mask.all():
        return [np.arange(count)]
    # Begin a cycle behind a frame of False, so that no run passes its end.
    start = int(np.argmin(mask)) if cyclic else 0
    # `np.roll` takes twice the time of all the rest.
    turned = np.concatenate([[False], mask[start:], mask[:start], [False]])
    edges = np.flatnonzero(turned[1:] != turned[:-1]).reshape(-1, 2)
    return [(np.arange(first, end) + start) % count for first, end in edges]


def ground_velocity(
    paths: Annotated[Floats, "frames feet 3"], rate: float, thresholds: ContactThresholds = DEFAULT
) -> Annotated[Floats, "3"]:
    """Return the velocity (3,) of the ground, m/s, under feet (F, K, 3), m.

    It is the median velocity of low feet: zero for feet that stand, and the opposite of the travel
    of a motion whose travel was removed.
    """
    velocities = np.gradient(paths, axis=0) * rate
    heights = paths @ UP
    low = heights < np.percentile(heights, thresholds.ground, axis=0) + thresholds.height
    return np.asarray(np.median(velocities[low], axis=0) * (1.0 - UP))


def _speeds(
    path: Annotated[Floats, "frames 3"],
    rate: float,
    cyclic: bool,
    moving_ground: Annotated[Floats, "3"] | None,
    smoothing: float,
) -> Annotated[Floats, "_"]:
    """Return smoothed speeds (F,), or (F - 1,) of a cycle, relative to the ground, m/s."""
    ground = np.zeros(3) if moving_ground is None else moving_ground
    # A cycle's last step leads into its first, whatever its travel and heading.
    steps = np.linalg.norm(np.diff(path, axis=0) * rate - ground, axis=1)
    if cyclic:
        return _smooth((steps + np.roll(steps, 1)) / 2.0, smoothing * rate, cyclic)
    speeds = (np.append(steps, steps[-1]) + np.append(steps[0], steps)) / 2.0
    return _smooth(speeds, smoothing * rate, cyclic)


def _smooth(values: Annotated[Floats, "frames"], width: float, cyclic: bool) -> Floats:
    """Return values (F,) smoothed by a Gaussian with a standard deviation of `width` frames."""
    reach = int(np.ceil(SMOOTHING_REACH * width))
    kernel = np.exp(-0.5 * np.square(np.arange(-reach, reach + 1) / max(width, 1e-9)))
    padded = np.pad(values, reach, mode="wrap" if cyclic else "edge")
    return np.convolve(padded, kernel / kernel.sum(), mode="valid")


def _grow(seeds: Booleans, possible: Booleans, cyclic: bool) -> Annotated[Booleans, "frames"]:
    """Return the runs of `possible` frames that hold a seed."""
    grown = np.zeros_like(possible)
    for run in runs(possible, cyclic):
        grown[run] = seeds[run].any()
    return grown


# A foot within this of its lowest is on the ground, m.
PLANTED_HEIGHT = 0.02


def mean_skate_speed(
    feet: Annotated[Floats, "*clips frames feet 3"], rate: float
) -> Annotated[Floats, "*clips"]:
    """Return the mean horizontal speed (...) of planted feet (..., F, K, 3), m/s.

    feet: positions, m. rate: frames a second. A foot is planted while it is within 2 cm of the
    lowest height that it has in the motion. Zero if no foot is planted for two frames in a row.
    """
    heights, steps = feet[..., 1], np.diff(feet, axis=-3)
    down = heights < heights.min(axis=-2, keepdims=True) + PLANTED_HEIGHT
    planted = down[..., 1:, :] & down[..., :-1, :]
    speeds = rate * np.sqrt(np.square(steps[..., 0]) + np.square(steps[..., 2]))
    return np.sum(speeds * planted, axis=(-2, -1)) / np.maximum(planted.sum(axis=(-2, -1)), 1)
