"""Feet at joins, and facts about joins: how far poses are apart, and how fast they change.

No blend keeps the place of a foot that stands on both sides of a cut, at two places. So contacts
are changed around the cut, and `feet.body_plans` plans the feet over the whole performance. A join
is judged once, when its feet are placed: before that its peak is not known.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from posefield.common.units import UP, Floats, Frames
from posefield.feet.footsteps import Character
from posefield.feet.stance_rows import DECIMALS, STANDING
from posefield.locomotion import floor_plane
from posefield.model_file.model_card import USUAL_PERCENTILE, mean_accelerations
from posefield.motion import contact_detection
from posefield.motion.contact_detection import FootContact
from posefield.performance.joins import Blend, Cut, positions
from posefield.performance.passage import RATE, Passage, concatenate
from posefield.question.performance_report import Reference

MOST_DISTANCE = 0.25
"""Distance of the poses at a cut from which on a join is hard, m."""
MOST_PEAK = 3.0
"""Peak acceleration of a join over the usual one from which on it is hard (decision 0086)."""
MOST_DROP = 0.12
"""Difference of the roots' heights at a cut from which on a join is hard, m, unless the motions
that are joined rise and fall faster themselves, as a hop does."""
RISING, RISING_PERCENTILE = 1.0, 90.0
"""Time before and after a cut in which it is looked for how fast roots rise and fall, s, and the
percentile of their accelerations that counts: ends of clips have single larger ones."""
# The peak is looked for from this time before a join to this one after it, s.
BEFORE, AFTER = 0.1, 0.6
MOTIONS: Mapping[Reference, str] = {
    "captured": "captured clips of the models that are joined",
    "synthesised": "motions that are joined",
}
"""Motions that a join is compared with, in words."""


@dataclass(frozen=True)
class JoinFacts:
    """Facts about a join.

    distance: RMS distance of the joints at the cut, m. drop, most_drop: difference of the roots'
    heights there, and that from which on the join is hard, m. blend: its kind, and seconds that it
    lasts. usual: larger 99th percentile of the accelerations of the motions on both sides, m/s²,
    and reference: in which motions it was measured. segment: index of the one that begins, and
    frame at which it does. peak: largest mean over the joints of the acceleration relative to the
    root, m/s², from 0.1 s before to 0.6 s after the cut, in the motion that is sent; 0 until it is
    known.
    """

    distance: float
    drop: float
    blend: Blend
    usual: float
    reference: Reference
    segment: int = 0
    frame: int = 0
    seconds: float = 0.0
    peak: float = 0.0
    most_drop: float = MOST_DROP

    @property
    def reasons(self) -> tuple[str, ...]:
        """Return why a join is hard, in words; empty if it is not."""
        reasons = []
        if self.distance > MOST_DISTANCE:
            reasons.append(
                f"the poses are {100 * self.distance:.0f} cm apart, expected at most"
                f" {100 * MOST_DISTANCE:.0f}"
            )
        if self.drop > self.most_drop:
            reasons.append(
                f"the root is {100 * self.drop:.0f} cm higher on one side, expected at most"
                f" {100 * self.most_drop:.0f}"
            )
        if self.peak > MOST_PEAK * self.usual:
            reasons.append(
                f"joints accelerate by {self.peak:.0f} m/s2, expected at most {MOST_PEAK:g} times"
                f" the {self.usual:.1f} m/s2 of the {MOTIONS[self.reference]}"
            )
        return tuple(reasons)


def most_drop(before: Passage, after: Passage, cut: Cut, seconds: float) -> float:
    """Return the difference of the roots' heights from which on a join is hard, m.

    seconds: of the blend, which rises over a height h in a time T by at most 6 h / T², as the
    smooth step does.
    """
    frames = round(RISING * RATE)
    heights = (
        before.roots[max(cut.exit - frames, 0) : cut.exit + 1, 1],
        after.roots[cut.entry : cut.entry + frames + 1, 1],
    )
    rising = np.concatenate([np.abs(np.diff(side, n=2)) for side in heights]) * RATE**2
    usual = float(np.percentile(rising, RISING_PERCENTILE)) if len(rising) else 0.0
    return max(MOST_DROP, usual * seconds**2 / 6.0)


def accelerations(character: Character, passage: Passage, begin: int, end: int) -> Frames:
    """Return mean accelerations (F,) of the joints relative to the root, m/s².

    They are second differences, of the frames from `begin` until before `end`, without those at an
    end of the passage.
    """
    first, last = max(begin - 1, 0), min(end + 1, len(passage))
    if last - first < 3:
        return np.zeros(0)
    return mean_accelerations(positions(character, passage, first, last), RATE)


def usual_acceleration(character: Character, passages: Sequence[Passage]) -> float:
    """Return the 99th percentile of the accelerations of passages, of that with the largest, m/s².

    The passages are as their models made them: without joins.
    """
    accelerations_of_passages = [
        accelerations(character, passage, 0, len(passage)) for passage in passages
    ]
    return max(
        (
            float(np.percentile(values, USUAL_PERCENTILE))
            for values in accelerations_of_passages
            if len(values)
        ),
        default=0.0,
    )


def judge(
    character: Character, joins: Sequence[JoinFacts], motion: Passage, begin: int = 0
) -> list[JoinFacts]:
    """Return joins with their peaks in the motion that is sent, whose first frame is `begin`."""
    return [replace(join, peak=_peak(character, motion, join.frame - begin)) for join in joins]


def judge_act(
    character: Character, motion: Passage, frames: tuple[int, int], captured: float
) -> str:
    """Return a warning about an act that is faster than captured clips of its model; else "".

    motion: all frames of the performance, at `RATE`. frames: of the act, from its begin until
    before its end; those near joins count as the joins'. captured: 99th percentile of the
    accelerations of captured clips, m/s².
    """
    # The first and the last one of these frames have no acceleration of their own.
    begin = frames[0] + round(AFTER * RATE) if frames[0] else 0
    end = frames[1] - round(BEFORE * RATE) + 1 if frames[1] < len(motion.roots) else frames[1]
    values = accelerations(character, motion, begin + 1, max(end, begin) - 1)
    peak = float(values.max(initial=0.0))
    if peak <= MOST_PEAK * captured:
        return ""
    time = (begin + 1 + int(np.argmax(values))) / RATE
    return (
        f"joints accelerate by {peak:.0f} m/s2 at {time:.2f} s, expected at most {MOST_PEAK:g}"
        f" times the {captured:.1f} m/s2 of captured clips of the model"
    )


def _peak(character: Character, motion: Passage, frame: int) -> float:
    """Return the largest acceleration near a frame, m/s², as `JoinFacts.peak` is."""
    first = max(frame - round(BEFORE * RATE) - 1, 0)
    values = accelerations(character, motion, first + 1, frame + round(AFTER * RATE) + 1)
    return float(values.max(initial=0.0))


FARTHEST = 0.05
"""Distance over the floor by which a foot that stands on both sides may be moved, m."""
SWING, SUPPORT = 0.35, 0.05
"""Durations of a step over a join, and of the time on both feet before the next one, s."""
LANDING = 0.4
"""Time within which a foot that swings before a join lands after it, s."""
# A swing of the other foot is put off if this much of it is left, s.
SHORTEST_SWING = 0.2
# A foot that has come so near the height that it has after a join is on the ground, m.
LOW = contact_detection.DEFAULT.height


@dataclass(frozen=True)
class JoinStep:
    """A step over a join. foot: column of the contacts. begin, end: frames. distance: m."""

    foot: int
    begin: int
    end: int
    distance: float


def on_floor(
    character: Character, passage: Passage, contacts: Sequence[FootContact], floor: float = 0.0
) -> tuple[Passage, float]:
    """Return a passage whose feet stand as high as captured ones do, and how far it was raised, m.

    A model of another character, or another model of the same one, may have feet that float or sink
    by a few cm. One height for a whole performance cannot mend that, so each passage has its own:
    by the median over the frames in which a foot stands, and the mean over its feet. contacts: of
    the character's legs. floor: its height, m.
    """
    heights = _balls(character, passage) @ UP
    down = np.round(passage.contacts, DECIMALS) > STANDING
    above = [
        float(np.median(ball[standing])) - foot.height - floor
        for ball, foot, standing in zip(heights.T, contacts, down.T, strict=True)
        if standing.any()
    ]
    raised = -float(np.mean(above)) if above else 0.0
    return replace(passage, roots=passage.roots + raised * UP), raised


def add_steps(
    character: Character, before: Passage, after: Passage, cut: Cut, joined: Passage
) -> tuple[Passage, tuple[JoinStep, ...]]:
    """Return a joined passage with contacts that let feet step over the cut, and the steps.

    after: where the cut places it. joined: `joins.join` of both, or a longer passage with the join
    at frame `cut.exit`. A foot that stands more than 5 cm apart on both sides steps, one foot after
    another, the farthest first. A foot that swings before the cut and stands after it lands where
    it has come near the ground and its place.
    """
    end = min(cut.exit + round((LANDING + 2.0 * (SWING + SUPPORT)) * RATE), len(joined))
    left, right = (
        before.part(cut.exit, cut.exit + 1),
        after.part(cut.entry, cut.entry + end - cut.exit),
    )
    blended = joined.part(cut.exit, cut.exit + len(right))
    # All at once: for so few poses each call takes longer than the poses.
    balls = _balls(character, concatenate(left, right, blended))
    ball_before, balls_after, balls_blended = (
        balls[0],
        balls[1 : 1 + len(right)],
        balls[1 + len(right) :],
    )
    stands = [
        np.round(side.contacts[at], DECIMALS) > STANDING
        for side, at in ((before, cut.exit), (after, cut.entry))
    ]
    contacts = joined.contacts.copy()
    landed = cut.exit
    for foot in np.flatnonzero(~stands[0] & stands[1]).tolist():
        last = cut.exit + _landing(balls_blended[:, foot], balls_after[:, foot])
        contacts[cut.exit : last, foot] = 0.0
        landed = max(landed, last)
    distances = _apart(ball_before, balls_after[0])
    must = np.flatnonzero(stands[0] & stands[1] & (np.round(distances, DECIMALS) > FARTHEST))
    steps = []
    for foot in sorted(
        must.tolist(), key=lambda foot: (-round(float(distances[foot]), DECIMALS), foot)
    ):
        step = JoinStep(foot, landed, landed + round(SWING * RATE), float(distances[foot]))
        _swing(contacts, step)
        steps.append(step)
        landed = step.end + round(SUPPORT * RATE)
    return replace(joined, contacts=contacts), tuple(steps)


def _balls(character: Character, passage: Passage) -> Annotated[Floats, "frames feet 3"]:
    poses = passage.limbs(character, [leg.tip for leg in character.legs])
    balls = [poses.position(leg.tip) for leg in character.legs]
    return np.stack(balls, axis=1) if balls else np.zeros((len(passage), 0, 3))


def _apart(
    points: Annotated[Floats, "*#batch 3"], other_points: Annotated[Floats, "*#batch 3"]
) -> Annotated[Floats, "*batch"]:
    """Return distances over the floor, m."""
    distances: Floats = np.abs(floor_plane.project(points) - floor_plane.project(other_points))
    return distances


def _landing(
    path: Annotated[Floats, "frames 3"], target_path: Annotated[Floats, "frames 3"]
) -> int:
    """Return the number of frames from a cut to the landing of a foot.

    It lands once its shown path is within 5 cm of the place where it stands after the join, and
    nearly as low; at `LANDING` at the latest.
    """
    count = min(len(path), len(target_path), round(LANDING * RATE))
    points, target_points = path[:count], target_path[:count]
    near = (_apart(points, target_points) <= FARTHEST) & (
        np.abs(points[:, 1] - target_points[:, 1]) <= LOW
    )
    return int(np.argmax(near)) if near.any() else count


def _swing(contacts: Annotated[Floats, "frames feet"], step: JoinStep) -> None:
    """Change contacts so that one foot swings, while those that stand when it begins stay."""
    begin, end = step.begin, min(step.end, len(contacts))
    if begin >= end:
        return
    for other in range(contacts.shape[1]):
        if other == step.foot or contacts[begin, other] <= STANDING:
            continue
        lifted = contacts[begin:end, other] <= STANDING
        if lifted.any() and _left(contacts[end:, other]) >= round(SHORTEST_SWING * RATE):
            contacts[begin:end, other] = 1.0
    contacts[begin:end, step.foot] = 0.0


def _left(contacts: Sequence[float] | Floats) -> int:
    standing = np.asarray(contacts) > STANDING
    return int(np.argmax(standing)) if standing.any() else len(standing)
