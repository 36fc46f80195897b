"""Stances and swings of the feet of many walkers at once, by the rules of `stances`.

Each row is one foot of one walker, whose motion does not repeat. Stances of a row depend on no
other row.
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from posefield.common.units import MICROMETRES, UP, Booleans, Floats, Indices
from posefield.feet.stances import (
    LIFTED,
    SHORTEST_CONTACT,
    SHORTEST_GAP,
    SHORTEST_STEP,
)
from posefield.locomotion import floor_plane
from posefield.motion.foot_contacts import FootContact

Rows = Annotated[Booleans, "rows frames"]
PerRow = Annotated[Floats, "rows"]
PerRun = Annotated[Indices, "runs"]


@dataclass(frozen=True)
class FootRows:
    """Feet of walkers: predicted paths, and how captured feet contact and swing.

    positions: (R, F, 3), m. rate: frames a second. height, swing, longest_swing, clearance: (R,),
    as of `FootContact`.
    """

    positions: Annotated[Floats, "rows frames 3"]
    rate: float
    height: PerRow
    swing: PerRow
    longest_swing: PerRow
    clearance: PerRow

    def select(self, rows: Annotated[Indices, "chosen"]) -> "FootRows":
        """Return some of the rows."""
        own = (self.height, self.swing, self.longest_swing, self.clearance)
        return FootRows(self.positions[rows], self.rate, *(part[rows] for part in own))

    @property
    def heights(self) -> Annotated[Floats, "rows frames"]:
        """Return the heights (R, F), m."""
        found: Floats = self.positions @ UP
        return found


def foot_rows(
    positions: Annotated[Floats, "rows frames 3"],
    rate: float,
    contacts: tuple[FootContact, ...],
    height: PerRow,
) -> FootRows:
    """Return rows of feet (R, F, 3), m, whose contacts repeat, with their own heights (R,), m."""
    walkers = len(positions) // len(contacts)
    swing, longest, clearance = (
        np.tile([getattr(own, name) for own in contacts], walkers)
        for name in ("swing", "longest_swing", "clearance")
    )
    return FootRows(positions, rate, height, swing, longest, clearance)


@dataclass(frozen=True)
class Runs:
    """Runs of true frames, row by row and in order: frames `begins` to `ends`, exclusive."""

    rows: PerRun
    begins: PerRun
    ends: PerRun

    @property
    def lengths(self) -> PerRun:
        """Return the numbers of frames."""
        return self.ends - self.begins

    def select(self, chosen: Annotated[Booleans, "runs"] | PerRun) -> "Runs":
        """Return some of the runs."""
        return Runs(self.rows[chosen], self.begins[chosen], self.ends[chosen])

    def inner(self, frames: int) -> Annotated[Booleans, "runs"]:
        """Return which runs touch no end of the F frames."""
        found: Booleans = (self.begins > 0) & (self.ends < frames)
        return found

    def mask(self, shape: tuple[int, ...]) -> Rows:
        """Return whether each frame (R, F) is in one of the runs, which do not overlap."""
        edges = np.zeros((shape[0], shape[1] + 1), np.int8)
        np.add.at(edges, (self.rows, self.begins), 1)
        np.add.at(edges, (self.rows, self.ends), -1)
        found: Booleans = np.cumsum(edges, axis=1, dtype=np.int8)[:, :-1] > 0
        return found

    def frames(self) -> tuple[PerRun, PerRun]:
        """Return the run and the frame of all frames of all runs, run after run."""
        run = np.repeat(np.arange(len(self.rows)), self.lengths)
        starts = np.cumsum(self.lengths) - self.lengths
        return run, np.arange(len(run)) - starts[run] + self.begins[run]


def runs(down: Rows) -> Runs:
    """Return the runs of true frames."""
    edges = np.diff(np.pad(down.astype(np.int8), ((0, 0), (1, 1))), axis=1)
    rows, begins = np.nonzero(edges == 1)
    return Runs(rows, begins, np.nonzero(edges == -1)[1])


def tidy(down: Rows, rate: float) -> Rows:
    """Return frames (R, F) with short gaps closed, then short contacts dropped."""
    count = down.shape[1]
    gaps = runs(~down)
    short = gaps.inner(count) & (gaps.lengths < SHORTEST_GAP * rate)
    found = runs(down | gaps.select(short).mask(down.shape))
    kept = ~found.inner(count) | (found.lengths >= SHORTEST_CONTACT * rate)
    return found.select(kept).mask(down.shape)


def discipline(down: Rows, feet: FootRows) -> Rows:
    """Return frames (R, F) in which feet stand, with swings as captured ones are."""
    swings = runs(~down)
    swinging = _swing_frames(swings, feet)
    grounded = feet.heights < (feet.height + LIFTED)[:, None]
    return tidy(down | (~down & ~swinging & grounded), feet.rate)


def _swing_frames(swings: Runs, feet: FootRows) -> Rows:
    """Return the frames (R, F) of swings in which the foot swings indeed."""
    floor = floor_plane.project(feet.positions)
    shape = floor.shape
    first, last = np.maximum(swings.begins - 1, 0), np.minimum(swings.ends, shape[1] - 1)
    steps = np.abs(floor[swings.rows, last] - floor[swings.rows, first])
    goes = ~swings.inner(shape[1]) | (steps >= SHORTEST_STEP)
    long = swings.lengths > feet.longest_swing[swings.rows] * feet.rate
    begins, ends = swings.begins.copy(), swings.ends.copy()
    for run in np.flatnonzero(goes & long):
        row, size = swings.rows[run], int(swings.lengths[run])
        length = min(max(2, round(float(feet.swing[row]) * feet.rate)), size - 1)
        places = floor[row, begins[run] : ends[run]]
        gone = np.round(np.abs(places[length:] - places[:-length]), MICROMETRES)
        begins[run] += int(np.argmax(gone))
        ends[run] = begins[run] + length
    return Runs(swings.rows, begins, ends).select(goes).mask(shape)


def shortened(down: Rows, beyond: Rows, rate: float) -> Rows:
    """Return stances (R, F) without the frames beyond reach: of each the longest run that is left.

    A stance that becomes too short is dropped.
    """
    label = np.cumsum(down & ~np.pad(down, ((0, 0), (1, 0)))[:, :-1], axis=1)
    parts = runs(down & ~beyond)
    parts = parts.select(parts.lengths >= SHORTEST_CONTACT * rate)
    whose = label[parts.rows, parts.begins]
    order = np.lexsort((parts.begins, -parts.lengths, whose, parts.rows))
    best = parts.select(order)
    whose = whose[order]
    same = (best.rows[1:] == best.rows[:-1]) & (whose[1:] == whose[:-1])
    return best.select(np.concatenate([[True], ~same])[: len(whose)]).mask(down.shape)
