"""Statistics of the contacts of a foot with the ground, measured of the captured clips."""

from dataclasses import dataclass

from posefield.common.bounded_types import Index, NonNegative, Number, Positive

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
