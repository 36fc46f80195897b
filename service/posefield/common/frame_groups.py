"""Frames of several motions in one array, motion after motion.

Sums over the frames of a motion go in an order that depends on this motion alone, so that it has
the same bytes in every batch.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from posefield.common.units import Booleans, Floats, Indices

Numbers = npt.NDArray[Any]


@dataclass(frozen=True)
class FrameGroups:
    """Numbers of frames of M motions, whose N frames lie one after another. counts: (M,)."""

    counts: Annotated[Indices, "motions"]

    def __len__(self) -> int:
        return len(self.counts)

    @cached_property
    def starts(self) -> Annotated[Indices, "motions"]:
        """Return the first frame of each motion (M,) in the array."""
        starts: Indices = np.cumsum(self.counts) - self.counts
        return starts

    @cached_property
    def group(self) -> Annotated[Indices, "frames"]:
        """Return the motion of each frame (N,)."""
        return np.repeat(np.arange(len(self.counts)), self.counts)

    @cached_property
    def frame(self) -> Annotated[Indices, "frames"]:
        """Return the index of each frame (N,) in its motion."""
        frame: Indices = np.arange(len(self.group)) - self.starts[self.group]
        return frame

    def split(self, values: Annotated[Numbers, "frames ..."]) -> list[Numbers]:
        """Return the part of values (N, ...) of each motion."""
        stops = self.starts + self.counts
        return [values[a:b] for a, b in zip(self.starts.tolist(), stops.tolist(), strict=True)]

    def sums(self, values: Annotated[Floats, "frames ..."]) -> Annotated[Floats, "motions ..."]:
        """Return the sums (M, ...) over the frames of each motion, none of which is empty."""
        sums: Floats = np.add.reduceat(values, self.starts, axis=0)
        return sums

    def means(self, values: Annotated[Floats, "frames ..."]) -> Annotated[Floats, "motions ..."]:
        """Return the means (M, ...) over the frames of each motion."""
        return self.sums(values) / self.counts.reshape(-1, *(1 for _ in values.shape[1:]))

    def largest(self, values: Annotated[Floats, "frames"]) -> Annotated[Floats, "motions"]:
        """Return the largest value (M,) of each motion."""
        largest: Floats = np.maximum.reduceat(values, self.starts)
        return largest

    def smallest(self, values: Annotated[Floats, "frames"]) -> Annotated[Floats, "motions"]:
        """Return the smallest value (M,) of each motion."""
        smallest: Floats = np.minimum.reduceat(values, self.starts)
        return smallest


class FrameRows(NamedTuple):
    """Grids of R rows. rates: (R,), frames a second. cyclic: whether each row repeats (R,)."""

    groups: FrameGroups
    rates: Annotated[Floats, "rows"]
    cyclic: Annotated[Booleans, "rows"]

    @property
    def counts(self) -> Annotated[Indices, "rows"]:
        """Return the numbers of frames (R,)."""
        return self.groups.counts

    def flat(self, rows: Indices, frames: Indices) -> Indices:
        """Return the indices of frames of rows in the array; frames may lie after a cycle."""
        indices: Indices = self.groups.starts[rows] + frames % self.counts[rows]
        return indices

    def select(self, rows: Annotated[Indices, "chosen"]) -> "FrameRows":
        """Return some of the rows."""
        return FrameRows(FrameGroups(self.counts[rows]), self.rates[rows], self.cyclic[rows])

    def beside(self, offset: int) -> Annotated[Indices, "frames"]:
        """Return the index of the frame that is `offset` frames after each frame (N,).

        Over the ends of a row that does not repeat it is the first or the last frame.
        """
        groups = self.groups
        frame, count = groups.frame + offset, self.counts[groups.group]
        shifted = np.where(self.cyclic[groups.group], frame % count, np.clip(frame, 0, count - 1))
        return np.asarray(groups.starts[groups.group] + shifted)


def of_lengths(values: Sequence[Numbers]) -> FrameGroups:
    """Return the groups of arrays (F, ...) that are put one after another."""
    return FrameGroups(np.array([len(value) for value in values]))


def one_row(frames: int, rate: float, cyclic: bool = False) -> FrameRows:
    """Return the grid of one motion."""
    return FrameRows(FrameGroups(np.array([frames])), np.array([rate]), np.array([cyclic]))
