"""Levels of detail of walkers over time: who switches when, and by how much at a time.

A switch takes a quarter of a second, in which poses of both levels are mixed. What is needed is
known beforehand, so a finer level is there by the moment that the coarser one would show.
"""

from dataclasses import dataclass

import numpy as np

from service.motion import blend
from service.motion.conventions import Floats, Indices
from service.synthesis import view
from service.synthesis.view import HYSTERESIS, Camera, Ladder

SWITCH = 0.25
"""Seconds from one level to another."""


@dataclass(frozen=True)
class Detail:
    """What N characters are shown at in F frames.

    levels (N, F), those that they come from (N, F), and how much (N, F) of the way is behind them:
    one, but while they switch.
    """

    levels: Indices
    before: Indices
    shares: Floats

    def of(self, who: Indices) -> "Detail":
        """That of some characters (M,)."""
        return Detail(self.levels[who], self.before[who], self.shares[who])


def constant(level: int, shape: tuple[int, ...]) -> Detail:
    """One level for all characters and frames (N, F)."""
    levels = np.full(shape, level)
    return Detail(levels, levels, np.ones(shape))


def scale(camera: Camera, centres: Floats, radius: float) -> Floats:
    """Pixels (N, F) that a metre covers on characters of a radius, m, round centres (N, F, 3), m.

    InvalidField names a character that the camera is in.
    """
    frames = range(centres.shape[1])
    columns = [view.pixels_per_metre(camera, centres[:, frame], radius) for frame in frames]
    return np.stack(columns, axis=1)


def seen(ladder: Ladder, scale: Floats, limit: float, rate: float) -> Detail:
    """The coarsest levels whose errors cover at most `limit` pixels at a scale (N, F), all through
    every switch; the finest where none does."""
    switch = max(1, round(SWITCH * rate))
    # A switch that has just begun ends before the next one does.
    ahead = 2 * switch
    needed = _least_ahead(_levels(ladder, scale, limit), ahead)
    spare = _least_ahead(_levels(ladder, scale, limit * (1.0 - HYSTERESIS)), ahead)
    held, before = needed[:, 0], needed[:, 0]
    age, columns = np.full(len(held), switch), []
    for need, may in zip(needed.T, spare.T, strict=True):
        wanted = np.where(need < held, need, np.maximum(held, may))
        wanted = np.where(age < switch, held, wanted)
        turning = wanted != held
        before, age = np.where(turning, held, before), np.where(turning, 0, age + 1)
        held = wanted
        columns.append((held, before, np.minimum((age + 1) / (switch + 1), 1.0)))
    levels, origins, shares = (np.stack(column, axis=1) for column in zip(*columns, strict=True))
    return Detail(levels, origins, blend.eased(shares))


def _levels(ladder: Ladder, scale: Floats, limit: float) -> Indices:
    return view.choose(ladder.errors, scale.ravel(), limit).reshape(scale.shape)


def _least_ahead(levels: Indices, frames: int) -> Indices:
    """Finest level (N, F) from each frame on, so many frames ahead."""
    padded = np.pad(levels, ((0, 0), (0, frames)), mode="edge")
    windows = np.lib.stride_tricks.sliding_window_view(padded, frames + 1, axis=1)
    least: Indices = windows.min(axis=-1)
    return least
