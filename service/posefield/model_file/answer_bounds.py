"""Bounds of answers outside the sampled ranges.

Trends of the model are not followed without end: a control acts as if it were at most a quarter of
its range outside the sampled one, and a clip is at most a quarter shorter or longer than the
captured ones. Within the sampled ranges nothing is bounded.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import TypeVar

import numpy as np

from posefield.common.units import Booleans, Floats, Singles
from posefield.model_file.model_card import Control

MARGIN = 0.25
"""Margin of controls, as a share of the sampled range, and of durations, as a share of the captured
ones. Measured on three families of captured motion and the procedural one: up to 0.15 of the range
outside the samples, supported answers last 0.93 times the shortest to 1.25 times the longest
captured clip; paths of walking crowds need controls up to 0.2 of a range outside.
"""
SLACK = 1e-6
"""Share of the range that a control inside it may lie outside by rounding."""

Bound = TypeVar("Bound", float, Floats)


@dataclass(frozen=True)
class AnswerBounds:
    """Bounds of a model's answers.

    low, high (d,): sampled range of each control. durations: shortest and longest captured clip, s.
    """

    low: Floats
    high: Floats
    durations: tuple[float, float]

    @cached_property
    def _inside(self) -> tuple[Floats, Floats]:
        slack = SLACK * (self.high - self.low)
        return self.low - slack, self.high + slack

    @cached_property
    def limits(self) -> tuple[Floats, Floats]:
        """Smallest and largest value (d,) at which each control acts."""
        return _with_margin(self.low, self.high)

    @property
    def duration_limits(self) -> tuple[float, float]:
        """Smallest and largest duration, s, of an answer outside the sampled ranges.

        The duration at the nearest controls inside the ranges is never outside the limits.
        """
        return self.durations[0] * (1.0 - MARGIN), self.durations[1] * (1.0 + MARGIN)

    def is_inside(self, controls: Floats | Singles) -> bool:
        """Return whether all controls (B, d) lie within the sampled ranges."""
        low, high = self._inside
        return bool(((controls >= low) & (controls <= high)).all())

    def outside(self, controls: Floats | Singles) -> Booleans:
        """Return whether a control of each row (B, d) lies outside its sampled range, (B,)."""
        low, high = self._inside
        return np.asarray(((controls < low) | (controls > high)).any(axis=1))

    def limit(self, controls: Floats | Singles) -> Floats | Singles:
        """Return the controls (B, d) at which the answer is computed; inside the limits the same.

        Keeps the type of the numbers.
        """
        low, high = (limit.astype(controls.dtype) for limit in self.limits)
        return np.asarray(np.clip(controls, low, high))

    def nearest_sampled(self, controls: Floats | Singles) -> Floats:
        """Return the nearest controls (B, d) inside the sampled ranges."""
        return np.clip(controls.astype(np.float64), self.low, self.high)

    def limit_durations(self, durations: Singles, nearest: Singles) -> Singles:
        """Return durations (B,), s, limited to the margin about the captured ones.

        nearest (B,): durations at the nearest controls inside the sampled ranges, which may lie
        further out where a combination of controls was never captured.
        """
        shortest, longest = np.array(self.duration_limits, durations.dtype)
        low, high = np.minimum(shortest, nearest), np.maximum(longest, nearest)
        return np.clip(durations, low, high)


def limit_control(control: Control, value: float) -> float:
    """Return the value at which a control acts: at most the margin outside its sampled range."""
    low, high = _with_margin(control.minimum, control.maximum)
    return min(max(value, low), high)


def _with_margin(low: Bound, high: Bound) -> tuple[Bound, Bound]:
    """Return the limits that lie the margin outside sampled ranges."""
    room = MARGIN * (high - low)
    return low - room, high + room
