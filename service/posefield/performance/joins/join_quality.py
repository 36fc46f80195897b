"""Facts about joins: how far the poses are apart, and how fast they change against usual motion."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from posefield.common.array_shapes import Frames
from posefield.common.units import UP
from posefield.feet.foot_placement import PlacedFrames
from posefield.feet.footsteps import Character
from posefield.performance.joins import cut_search
from posefield.performance.joins.blends import Blend
from posefield.performance.joins.cut_search import Cut
from posefield.performance.passages.passage import RATE, Passage

Placement = Callable[[slice], PlacedFrames]
"""Returns some frames of a performance at `RATE` as they are sent."""
MOST_DISTANCE = 0.25
"""Distance of the poses at a cut from which on a join is hard, m."""
MOST_PEAK = 3.0
"""Peak acceleration of a join over the usual one from which on it is hard."""
MOST_DROP = 0.12
"""Difference of the roots' heights at a cut from which on a join is hard, m."""
# The peak is looked for from this time before a join to this one after it, s.
BEFORE, AFTER = 0.1, 0.6
# Percentile of the accelerations of a motion that is its usual largest one.
USUAL = 99.0


@dataclass(frozen=True)
class JoinFacts:
    """Facts about a join.

    time: s. distance: RMS distance of the joints at the cut, m. blend: its kind. peak: largest mean
    over the joints of the acceleration relative to the root, m/s², from 0.1 s before to 0.6 s after
    the cut. usual: 99th percentile of the passages' own accelerations, m/s². drop: difference of
    the roots' heights at the cut, m.
    """

    time: float
    distance: float
    blend: Blend
    peak: float
    usual: float
    drop: float

    @property
    def hard(self) -> bool:
        """Say whether the poses are too far apart, or change too fast."""
        return bool(self.reasons)

    @property
    def reasons(self) -> tuple[str, ...]:
        """Return why a join is hard, in words; empty if it is not."""
        found = []
        if self.distance > MOST_DISTANCE:
            found.append(
                f"the poses are {100 * self.distance:.0f} cm apart, expected at most"
                f" {100 * MOST_DISTANCE:.0f}"
            )
        if self.drop > MOST_DROP:
            found.append(
                f"the root is {100 * self.drop:.0f} cm higher on one side, expected at most"
                f" {100 * MOST_DROP:.0f}"
            )
        if self.peak > MOST_PEAK * self.usual:
            found.append(
                f"joints accelerate by {self.peak:.0f} m/s2, expected at most {MOST_PEAK:g} times"
                f" the {self.usual:.1f} m/s2 of the motions that are joined"
            )
        return tuple(found)

    @property
    def sentence(self) -> str:
        """Return a warning about a hard join; empty if it is not."""
        said = " and ".join(self.reasons)
        return f"hard join at {self.time:.2f} s: {said}" if said else ""


def accelerations(character: Character, passage: Passage, begin: int, end: int) -> Frames:
    """Return mean accelerations (F,) of the joints relative to the root, m/s².

    They are second differences, of the frames from `begin` until before `end`, without those at an
    end of the passage.
    """
    first, last = max(begin - 1, 0), min(end + 1, len(passage))
    if last - first < 3:
        return np.zeros(0)
    found = cut_search.positions(character, passage, first, last)
    found = found - passage.roots[first:last, None]
    second = np.diff(found, n=2, axis=0) * RATE**2
    means: Frames = np.linalg.norm(second, axis=-1).mean(axis=-1)
    return means


def usual_acceleration(character: Character, passages: Sequence[Passage]) -> float:
    """Return the 99th percentile of the accelerations of passages, of that with the largest, m/s².

    The passages are as their models made them: without joins.
    """
    found = [accelerations(character, passage, 0, len(passage)) for passage in passages]
    return max((float(np.percentile(own, USUAL)) for own in found if len(own)), default=0.0)


def judge(
    character: Character,
    sides: tuple[Passage, Passage],
    cut: Cut,
    blend: Blend,
    joined: Passage,
    usual: float,
) -> JoinFacts:
    """Return the facts about a join.

    sides: passages before and after the cut. joined: passage with the join at frame `cut.exit`; it
    may be with placed feet. usual: `usual_acceleration` of the models' motions.
    """
    frame = cut.exit
    begin, end = frame - round(BEFORE * RATE), frame + round(AFTER * RATE) + 1
    found = accelerations(character, joined, begin, end)
    peak = float(found.max()) if len(found) else 0.0
    apart = (sides[0].roots[cut.exit] - sides[1].roots[cut.entry]) @ UP
    return JoinFacts(frame / RATE, cut.distance, blend, peak, usual, abs(float(apart)))


def judge_again(
    character: Character, frames: int, joins: list[tuple[int, JoinFacts]], placed: Placement
) -> list[JoinFacts]:
    """Return the facts of joins with the peaks of placed frames.

    frames: of the whole performance. joins: frame and facts of each.
    """
    return [replace(facts, peak=_peak(character, frames, frame, placed)) for frame, facts in joins]


def _peak(character: Character, frames: int, frame: int, placed: Placement) -> float:
    """Return the largest acceleration near a frame, m/s², as `JoinFacts.peak` is."""
    first = max(frame - round(BEFORE * RATE) - 1, 0)
    last = min(frame + round(AFTER * RATE) + 2, frames)
    found = placed(slice(first, last))
    count = len(found.roots)
    passage = Passage(found.rotations, found.roots, np.zeros((count, 0)), np.zeros(count))
    peaks = accelerations(character, passage, 0, count)
    return float(peaks.max()) if len(peaks) else 0.0
