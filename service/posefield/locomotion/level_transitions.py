"""Levels of detail of walking characters over time, with blended transitions.

A transition takes a quarter of a second, in which poses of both levels are blended. The required
levels are known in advance, so a finer level is complete before the coarser one would be noticed.
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from posefield.common import cancellation
from posefield.common.array_shapes import CharacterFrames
from posefield.common.units import Floats, Indices
from posefield.inference import level_selection
from posefield.inference.level_selection import HYSTERESIS, Camera, LevelTable
from posefield.motion import blend

TRANSITION_SECONDS = 0.25
"""Duration of a transition between levels, s."""


@dataclass(frozen=True)
class LevelSchedule:
    """Levels of detail of N characters in F frames.

    levels: (N, F). previous: (N, F), levels before. shares: (N, F), completed share of the
    transition, 1 outside transitions.
    """

    levels: Annotated[Indices, "*frames"]
    previous: Annotated[Indices, "*frames"]
    shares: Annotated[Floats, "*frames"]

    def select(self, who: Annotated[Indices, "chosen"]) -> "LevelSchedule":
        """Return the levels of some characters (M,)."""
        return LevelSchedule(self.levels[who], self.previous[who], self.shares[who])

    def rows(self, rows: slice) -> "LevelSchedule":
        """Return the levels of some of all frames (N F,), character by character."""
        levels, before, shares = self.levels.ravel(), self.previous.ravel(), self.shares.ravel()
        return LevelSchedule(levels[rows], before[rows], shares[rows])


def constant_schedule(level: int, shape: tuple[int, ...]) -> LevelSchedule:
    """Return one level for all characters and frames (N, F)."""
    levels = np.full(shape, level)
    return LevelSchedule(levels, levels, np.ones(shape))


def scale(
    camera: Camera, centres: Annotated[Floats, "characters frames 3"], radius: float
) -> CharacterFrames:
    """Return the pixels (N, F) that a metre covers on each character.

    centres: (N, F, 3), m. radius: of each body, m. Raises InvalidField, which names a character
    that contains the camera.
    """
    frames = range(centres.shape[1])
    columns = [
        level_selection.pixels_per_metre(camera, centres[:, frame], radius) for frame in frames
    ]
    return np.stack(columns, axis=1)


def schedule_levels(
    ladder: LevelTable, scale: CharacterFrames, limit: float, rate: float
) -> LevelSchedule:
    """Return the coarsest levels with errors of at most `limit` pixels, transitions included.

    scale: (N, F), pixels per metre. rate: frames a second. The finest level where none is within
    the limit.
    """
    switch = max(1, round(TRANSITION_SECONDS * rate))
    # Two transitions: one that has just begun ends before the next one.
    ahead = 2 * switch
    needed = _finest_ahead(_levels(ladder, scale, limit), ahead)
    spare = _finest_ahead(_levels(ladder, scale, limit * (1.0 - HYSTERESIS)), ahead)
    held, before = needed[:, 0], needed[:, 0]
    age, columns = np.full(len(held), switch), []
    for need, may in zip(needed.T, spare.T, strict=True):
        cancellation.check()
        wanted = np.where(need < held, need, np.maximum(held, may))
        wanted = np.where(age < switch, held, wanted)
        turning = wanted != held
        before, age = np.where(turning, held, before), np.where(turning, 0, age + 1)
        held = wanted
        columns.append((held, before, np.minimum((age + 1) / (switch + 1), 1.0)))
    levels, origins, shares = (np.stack(column, axis=1) for column in zip(*columns, strict=True))
    return LevelSchedule(levels, origins, blend.smoothstep(shares))


def _levels(
    ladder: LevelTable, scale: CharacterFrames, limit: float
) -> Annotated[Indices, "characters frames"]:
    return level_selection.select_by_error(ladder.errors, scale.ravel(), limit).reshape(scale.shape)


def _finest_ahead(
    levels: Annotated[Indices, "characters frames"], frames: int
) -> Annotated[Indices, "characters frames"]:
    """Return the finest level (N, F) from each frame on, over `frames` frames ahead."""
    padded = np.pad(levels, ((0, 0), (0, frames)), mode="edge")
    windows = np.lib.stride_tricks.sliding_window_view(padded, frames + 1, axis=1)
    least: Indices = windows.min(axis=-1)
    return least
