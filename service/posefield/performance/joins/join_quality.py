"""Facts about joins: how far the poses are apart, and how fast they change against usual motion.

A join is judged once, when its feet are placed: before that its peak is not known.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from posefield.common.array_shapes import Frames
from posefield.common.units import UP
from posefield.feet.foot_placement import PlacedFrames
from posefield.feet.footsteps import Character
from posefield.model_file.captured_acceleration import USUAL, mean_accelerations
from posefield.performance.joins import cut_search
from posefield.performance.joins.blends import Blend
from posefield.performance.joins.cut_search import Cut
from posefield.performance.passages.passage import RATE, Passage
from posefield.question.performance_report import Reference

MOST_DISTANCE = 0.25
"""Distance of the poses at a cut from which on a join is hard, m."""
MOST_PEAK = 3.0
"""Peak acceleration of a join over the usual one from which on it is hard (decision 0086)."""
MOST_DROP = 0.12
"""Difference of the roots' heights at a cut from which on a join is hard, m."""
# The peak is looked for from this time before a join to this one after it, s.
BEFORE, AFTER = 0.1, 0.6
MOTIONS: Mapping[Reference, str] = {
    "captured": "captured clips of the models that are joined",
    "synthesised": "motions that are joined",
}
"""Motions that a join is compared with, in words."""


@dataclass(frozen=True)
class UsualMotion:
    """Usual largest acceleration of the motions of a join, and where it was measured.

    acceleration: 99th percentile of the frames' accelerations, m/s². reference: of the models'
    captured clips, or of the motions as they were synthesised.
    """

    acceleration: float
    reference: Reference


@dataclass(frozen=True)
class CutFacts:
    """Facts about a join that stay when targets are met and feet are placed.

    distance: RMS distance of the joints at the cut, m. drop: difference of the roots' heights
    there, m. blend: its kind. usual: of the motions on both sides.
    """

    distance: float
    drop: float
    blend: Blend
    usual: UsualMotion


@dataclass(frozen=True)
class JoinFacts:
    """Facts about a join in the motion that is sent.

    peak: largest mean over the joints of the acceleration relative to the root, m/s², from 0.1 s
    before to 0.6 s after the cut.
    """

    cut: CutFacts
    peak: float

    @property
    def hard(self) -> bool:
        """Say whether the poses are too far apart, or change too fast."""
        return bool(self.reasons)

    @property
    def reasons(self) -> tuple[str, ...]:
        """Return why a join is hard, in words; empty if it is not."""
        cut, found = self.cut, []
        if cut.distance > MOST_DISTANCE:
            found.append(
                f"the poses are {100 * cut.distance:.0f} cm apart, expected at most"
                f" {100 * MOST_DISTANCE:.0f}"
            )
        if cut.drop > MOST_DROP:
            found.append(
                f"the root is {100 * cut.drop:.0f} cm higher on one side, expected at most"
                f" {100 * MOST_DROP:.0f}"
            )
        usual = cut.usual
        if self.peak > MOST_PEAK * usual.acceleration:
            found.append(
                f"joints accelerate by {self.peak:.0f} m/s2, expected at most {MOST_PEAK:g} times"
                f" the {usual.acceleration:.1f} m/s2 of the {MOTIONS[usual.reference]}"
            )
        return tuple(found)


def accelerations(character: Character, passage: Passage, begin: int, end: int) -> Frames:
    """Return mean accelerations (F,) of the joints relative to the root, m/s².

    They are second differences, of the frames from `begin` until before `end`, without those at an
    end of the passage.
    """
    first, last = max(begin - 1, 0), min(end + 1, len(passage))
    if last - first < 3:
        return np.zeros(0)
    return mean_accelerations(cut_search.positions(character, passage, first, last), RATE)


def usual_acceleration(character: Character, passages: Sequence[Passage]) -> float:
    """Return the 99th percentile of the accelerations of passages, of that with the largest, m/s².

    The passages are as their models made them: without joins.
    """
    found = [accelerations(character, passage, 0, len(passage)) for passage in passages]
    return max((float(np.percentile(own, USUAL)) for own in found if len(own)), default=0.0)


def describe_cut(
    sides: tuple[Passage, Passage], cut: Cut, blend: Blend, usual: UsualMotion
) -> CutFacts:
    """Return the facts about a cut. sides: passages before and after it."""
    apart = (sides[0].roots[cut.exit] - sides[1].roots[cut.entry]) @ UP
    return CutFacts(cut.distance, abs(float(apart)), blend, usual)


def judge(
    character: Character, joins: Sequence[tuple[int, CutFacts]], sent: PlacedFrames
) -> list[JoinFacts]:
    """Return the facts about joins in the motion that is sent.

    joins: frame and cut of each. sent: all frames of the performance, at `RATE`.
    """
    return [JoinFacts(cut, _peak(character, sent, frame)) for frame, cut in joins]


def judge_act(
    character: Character, sent: PlacedFrames, frames: tuple[int, int], captured: float
) -> str:
    """Return a warning about an act that is faster than captured clips of its model; else "".

    sent: all frames of the performance, at `RATE`. frames: of the act, from its begin until before
    its end; those near joins count as the joins'. captured: 99th percentile of the accelerations
    of captured clips, m/s².
    """
    # The first and the last one of these frames have no acceleration of their own.
    begin = frames[0] + round(AFTER * RATE) if frames[0] else 0
    end = frames[1] - round(BEFORE * RATE) + 1 if frames[1] < len(sent.roots) else frames[1]
    found = _accelerations(character, sent, slice(begin, max(end, begin)))
    peak = float(found.max(initial=0.0))
    if peak <= MOST_PEAK * captured:
        return ""
    time = (begin + 1 + int(np.argmax(found))) / RATE
    return (
        f"joints accelerate by {peak:.0f} m/s2 at {time:.2f} s, expected at most {MOST_PEAK:g}"
        f" times the {captured:.1f} m/s2 of captured clips of the model"
    )


def _peak(character: Character, sent: PlacedFrames, frame: int) -> float:
    """Return the largest acceleration near a frame, m/s², as `JoinFacts.peak` is."""
    first = max(frame - round(BEFORE * RATE) - 1, 0)
    found = _accelerations(character, sent, slice(first, frame + round(AFTER * RATE) + 2))
    return float(found.max(initial=0.0))


def _accelerations(character: Character, sent: PlacedFrames, rows: slice) -> Frames:
    """Return the mean accelerations of some frames without the first and the last one, m/s²."""
    rotations, roots = sent.rotations[rows], sent.roots[rows]
    count = len(roots)
    passage = Passage(rotations, roots, np.zeros((count, 0)), np.zeros(count))
    return accelerations(character, passage, 0, count)
