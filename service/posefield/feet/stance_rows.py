"""Stances and swings of many feet: from contact probabilities, as captured feet step.

Each row is one foot of one motion. Its frames lie on a grid of equal steps of time, and those of
all rows one after another. A stance of a cycle may go on over its end: its frames are then counted
beyond the last. Stances of a row depend on no other row.
"""

from collections.abc import Sequence
from typing import Annotated, NamedTuple

import numpy as np

from posefield.common import frame_groups
from posefield.common.frame_groups import FrameGroups, FrameRows
from posefield.common.units import MICROMETRES, Booleans, Floats, Indices
from posefield.locomotion import floor_plane
from posefield.locomotion.floor_plane import FloorVectors
from posefield.motion import contact_detection
from posefield.motion.contact_detection import CLEARANCE, LONG_SWING, FootContact

# Contacts that are shorter are dropped, and gaps that are shorter are closed, s.
SHORTEST_CONTACT = contact_detection.DEFAULT.shortest
SHORTEST_GAP = contact_detection.DEFAULT.shortest_gap
# A swing that goes less is none, m.
SHORTEST_STEP = 0.03
# A foot that is higher above the place where it stands is in the air whatever the plan says, m.
LIFTED = contact_detection.DEFAULT.grown_height
# A foot may stand this much higher, or lower, than captured feet do, m: soles differ.
UNEVEN, SUNK = 0.01, 0.005

FRAME_FIELDS = ("floor", "heights", "walking", "arms")

Mask = Annotated[Booleans, "frames"]
PerRow = Annotated[Floats, "rows"]
PerRun = Annotated[Indices, "runs"]


class Cycle(NamedTuple):
    """Floor motion from the start of a cycle to its end.

    way: displacement, m. factor: unit vector of the change of heading.
    """

    way: complex
    factor: complex


NO_CYCLE = Cycle(0.0, 1.0)


class Runs(NamedTuple):
    """Runs of frames, row by row and in order: frames `begins` to `ends`, exclusive."""

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

    def inner(self, rows: FrameRows) -> Annotated[Booleans, "runs"]:
        """Return which runs touch no end of their row; those of cycles do not."""
        touches = (self.begins == 0) | (self.ends >= rows.counts[self.rows])
        inner: Booleans = rows.cyclic[self.rows] | ~touches
        return inner

    def mask(self, rows: FrameRows) -> Mask:
        """Return whether each frame (N,) is in one of the runs."""
        mask = np.zeros(len(rows.groups.group), bool)
        run, frames = self.frames()
        mask[rows.flat(self.rows[run], frames)] = True
        return mask

    def frames(self) -> tuple[PerRun, PerRun]:
        """Return the run and the frame of all frames of all runs, run after run."""
        groups = FrameGroups(self.lengths)
        return groups.group, groups.frame + self.begins[groups.group]

    def sort(self) -> "Runs":
        """Return the runs row by row and in order."""
        return self.select(np.lexsort((self.begins, self.rows)))

    def of_rows(self, rows: Annotated[Indices, "chosen"]) -> "Runs":
        """Return the runs of some rows, in order, which are counted anew."""
        selected = self.select(np.isin(self.rows, rows))
        return selected._replace(rows=np.searchsorted(rows, selected.rows))

    def by_row(self, rows: int) -> list[tuple[range, ...]]:
        """Return the frames of the runs of each of R rows; they may lie after a cycle."""
        by_row: list[list[range]] = [[] for _ in range(rows)]
        intervals = zip(self.begins.tolist(), self.ends.tolist(), strict=True)
        for row, (begin, end) in zip(self.rows.tolist(), intervals, strict=True):
            by_row[row].append(range(begin, end))
        return [tuple(row_intervals) for row_intervals in by_row]


class FootRows(NamedTuple):
    """Feet: predicted paths, and how captured feet contact and swing.

    floor: (N,), over the floor. heights: (N,), m. height, swing, longest_swing, clearance: (R,), as
    of `FootContact`. ways, factors: (R,), of a cycle, as of `Cycle`. walking: whether the motion
    walks (N,). arms: from the ankles to the joints that contact (N, 3), m. flat_pitch: of an arm on
    a flat foot (R,), rad.
    """

    rows: FrameRows
    floor: Annotated[FloorVectors, "frames"]
    heights: Annotated[Floats, "frames"]
    height: PerRow
    swing: PerRow
    longest_swing: PerRow
    clearance: PerRow
    ways: Annotated[FloorVectors, "rows"]
    factors: Annotated[FloorVectors, "rows"]
    walking: Mask
    arms: Annotated[Floats, "frames 3"]
    flat_pitch: PerRow

    def select(self, rows: Annotated[Indices, "chosen"]) -> "FootRows":
        """Return some of the rows."""
        frames = np.isin(self.rows.groups.group, rows)
        selected = {name: getattr(self, name)[frames] for name in FRAME_FIELDS}
        names = ("height", "swing", "longest_swing", "clearance", "ways", "factors", "flat_pitch")
        selected |= {name: getattr(self, name)[rows] for name in names}
        return self._replace(rows=self.rows.select(rows), **selected)

    def contact(self, row: int) -> FootContact:
        """Return the statistics of one row's contacts."""
        statistics = (self.height, self.swing, self.longest_swing, self.clearance)
        return FootContact(0, *(float(values[row]) for values in statistics))


def places(
    feet: FootRows, floor: Annotated[FloorVectors, "frames"], rows: PerRun, frames: PerRun
) -> Annotated[FloorVectors, "runs"]:
    """Return floor points of paths (N,) at frames, which may lie within later cycles."""
    points: FloorVectors = floor[feet.rows.flat(rows, frames)]
    later = np.where(feet.rows.cyclic[rows], frames // feet.rows.counts[rows], 0)
    for cycle in range(int(later.max(initial=0))):
        next_cycle = feet.ways[rows] + feet.factors[rows] * points
        points = np.where(later > cycle, next_cycle, points)
    return points


def from_intervals(rows: Sequence[Sequence[range]]) -> Runs:
    """Return the runs of rows, each with its intervals."""
    runs = [
        (row, interval.start, interval.stop)
        for row, intervals in enumerate(rows)
        for interval in intervals
    ]
    return Runs(*np.array(runs, np.int64).reshape(-1, 3).T)


def shortest(rows: FrameRows) -> PerRow:
    """Return the least number of frames of a stance (R,); one frame is none in a cycle."""
    return np.asarray(np.maximum(SHORTEST_CONTACT * rows.rates, 1.0 + rows.cyclic))


def runs(down: Mask, rows: FrameRows) -> Runs:
    """Return the runs of true frames (N,); one of a cycle may go over its end."""
    starts, counts = rows.groups.starts, rows.counts
    before, after = np.zeros((2, len(down)), bool)
    before[1:], after[:-1] = down[:-1], down[1:]
    before[starts] = after[starts + counts - 1] = False
    begins, stops = np.flatnonzero(down & ~before), np.flatnonzero(down & ~after) + 1
    row = rows.groups.group[begins]
    begins, stops = begins - starts[row], stops - starts[row]
    # The last run of a cycle goes on as its first one.
    first = np.flatnonzero(rows.cyclic[row] & (begins == 0))
    last = np.flatnonzero(rows.cyclic[row] & (stops == counts[row]))
    _, first_index, last_index = np.intersect1d(
        row[first], row[last], assume_unique=True, return_indices=True
    )
    first, last = first[first_index], last[last_index]
    different = first != last
    first, last = first[different], last[different]
    joined_stops, remaining = stops.copy(), np.ones(len(stops), bool)
    joined_stops[last] += stops[first]
    remaining[first] = False
    return Runs(row[remaining], begins[remaining], joined_stops[remaining])


def tidy(down: Mask, rows: FrameRows) -> Runs:
    """Return the runs of true frames; short gaps are closed, then short contacts dropped.

    A gap at an end of a motion is a part of a swing, and a contact there may have begun before it.
    """
    gaps = runs(~down, rows)
    short = gaps.inner(rows) & (gaps.lengths < SHORTEST_GAP * rows.rates[gaps.rows])
    contacts = runs(down | gaps.select(short).mask(rows), rows)
    return contacts.select(
        ~contacts.inner(rows) | (contacts.lengths >= shortest(rows)[contacts.rows])
    )


def discipline(stances: Runs, feet: FootRows) -> Runs:
    """Return stances whose swings are as captured ones: they go somewhere, and do not last.

    A swing that goes less than 3 cm is none. One that lasts longer than the captured ones is cut
    to their median duration, where the predicted foot goes most. Slow walkers take longer steps in
    time than most captured ones: swings within a walk stay as they are. A foot that is in the air
    does not stand.
    """
    down, group = stances.mask(feet.rows), feet.rows.groups.group
    swings, grounded = runs(~down, feet.rows), feet.heights < (feet.height + LIFTED)[group]
    if not len(swings.rows):
        return tidy(down | grounded, feet.rows)
    before = np.maximum(swings.begins - 1, 0)
    after_swings, before_swings = (
        places(feet, feet.floor, swings.rows, frames) for frames in (swings.ends, before)
    )
    step = np.abs(after_swings - before_swings)
    goes = ~swings.inner(feet.rows) | (step >= SHORTEST_STEP)
    long = swings.lengths > (feet.longest_swing * feet.rows.rates)[swings.rows]
    run, frames = swings.frames()
    walking = feet.walking[feet.rows.flat(swings.rows[run], frames)]
    walks = np.logical_and.reduceat(walking, FrameGroups(swings.lengths).starts)
    begins, stops = swings.begins.copy(), swings.ends.copy()
    for index in np.flatnonzero(goes & long & ~walks):
        begins[index], stops[index] = _cut(feet, swings.rows[index], begins[index], stops[index])
    swinging = Runs(swings.rows, begins, stops).select(goes).mask(feet.rows)
    return tidy(down | (~swinging & grounded), feet.rows)


def _cut(feet: FootRows, row: int, begin: int, end: int) -> tuple[int, int]:
    """Return the frames of a long swing, for the median duration, in which the foot goes most."""
    length = min(max(2, round(float(feet.swing[row] * feet.rows.rates[row]))), end - begin - 1)
    frames = np.arange(begin, end)
    points = places(feet, feet.floor, np.full(len(frames), row), frames)
    gone = np.round(np.abs(points[length:] - points[:-length]), MICROMETRES)
    first = begin + int(np.argmax(gone))
    return first, first + length


def shortened(stances: Runs, beyond: Mask, rows: FrameRows) -> Runs:
    """Return stances without the frames (N,) beyond reach: of each the longest run that is left.

    A stance that becomes too short is dropped.
    """
    run, frames = stances.frames()
    in_reach = ~beyond[rows.flat(stances.rows[run], frames)]
    stance_rows = FrameRows(
        FrameGroups(stances.lengths), rows.rates[stances.rows], np.zeros(len(stances.rows), bool)
    )
    pieces = runs(in_reach, stance_rows)
    pieces = pieces.select(np.lexsort((pieces.begins, -pieces.lengths, pieces.rows)))
    first = np.ones(len(pieces.rows), bool)
    first[1:] = pieces.rows[1:] != pieces.rows[:-1]
    pieces = pieces.select(first & (pieces.lengths >= shortest(rows)[stances.rows[pieces.rows]]))
    row, begins = stances.rows[pieces.rows], stances.begins[pieces.rows] + pieces.begins
    # A stance of a cycle begins within it.
    begins = np.where(begins >= rows.counts[row], begins - rows.counts[row], begins)
    return Runs(row, begins, begins + pieces.lengths).sort()


# A foot stands where its contact is more likely than not. Probabilities are rounded, so that two
# machines whose last digits differ plan the same steps.
STANDING, DECIMALS = 0.5, 6
# Swings of a motion in which no foot swings: median and longest duration, s.
DEFAULT_SWING, DEFAULT_LONGEST = 0.3, 0.5


def detect(path: Annotated[Floats, "frames 3"], rate: float, cycle: Cycle | None = None) -> Mask:
    """Return whether a foot with a path (F, 3), m, is in contact, by its speed and height (F,)."""
    if cycle is None:
        return contact_detection.detect_contacts(path, rate, False)
    floor, heights = floor_plane.project(path[:1]), path[:1, 1]
    after = floor_plane.at_height(cycle.way + cycle.factor * floor, heights)
    return contact_detection.detect_contacts(np.concatenate([path, after]), rate, True)[:-1]


def statistics(
    joint: int, heights: Annotated[Floats, "frames"], rate: float, down: Mask, cyclic: bool = False
) -> FootContact:
    """Return the statistics of a foot's contacts in one motion.

    heights: of the foot (F,), m. down: whether it stands (F,).
    """
    height = float(np.median(heights[down])) if down.any() else float(heights.min())
    row = frame_groups.one_row(len(heights), rate, cyclic)
    swings = runs(~down, row)
    swings = swings.select(swings.inner(row))
    if not len(swings.rows):
        return FootContact(joint, height, DEFAULT_SWING, DEFAULT_LONGEST, 0.0)
    _, frames = swings.frames()
    seconds = swings.lengths / rate
    lifts = FrameGroups(swings.lengths).largest(heights[frames % len(heights)]) - height
    return FootContact(
        joint,
        height,
        float(np.median(seconds)),
        float(np.percentile(seconds, LONG_SWING)),
        max(0.0, float(np.percentile(lifts, CLEARANCE))),
    )


def heights_above(
    heights: Annotated[Floats, "frames"],
    contacts: Runs,
    captured_heights: Annotated[Floats, "rows"],
    rows: FrameRows,
) -> Annotated[Floats, "rows"]:
    """Return how much higher feet stand than captured ones do (R,), by their medians, m.

    heights: (N,), m. captured_heights: heights (R,), m, of captured feet.
    """
    run, frames = contacts.frames()
    row = contacts.rows[run]
    offsets = heights[rows.flat(row, frames)] - captured_heights[row]
    return row_percentiles(offsets, row, len(captured_heights), 50.0)


def row_percentiles(
    values: Annotated[Floats, "values"], row: Indices, rows: int, percent: float
) -> PerRow:
    """Return percentiles (R,) of values (V,) that lie row after row (V,); zero without any."""
    counts = np.bincount(row, minlength=rows)
    ordered = np.concatenate([np.sort(of_row) for of_row in FrameGroups(counts).split(values)])
    percentiles = np.zeros(rows)
    some = counts > 0
    first, last = (np.cumsum(counts) - counts)[some], counts[some] - 1
    rank = 0.01 * percent * last
    before = rank.astype(np.int64)
    low, high = ordered[first + before], ordered[first + np.minimum(before + 1, last)]
    percentiles[some] = low + (rank - before) * (high - low)
    return percentiles
