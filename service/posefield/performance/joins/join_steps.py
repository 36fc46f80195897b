"""Feet at a join: each passage stands on the floor, and feet step to where they stand after it.

No blend keeps the place of a foot that stands on both sides of a cut, at two places. So contacts
are changed around the cut, and `feet.footsteps` plans the feet over the whole performance.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from posefield.common.units import UP, Booleans, Floats
from posefield.feet import limbs
from posefield.feet.contact_estimates import DECIMALS, STANDING
from posefield.feet.footsteps import Character
from posefield.locomotion import floor_plane
from posefield.motion.contacts import contact_detection
from posefield.motion.foot_contacts import FootContact
from posefield.performance.joins.cut_search import Cut
from posefield.performance.passages.passage import RATE, Passage, concatenate

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
        float(np.median(ball[own])) - foot.height - floor
        for ball, foot, own in zip(heights.T, contacts, down.T, strict=True)
        if own.any()
    ]
    raised = -float(np.mean(above)) if above else 0.0
    return replace(passage, roots=passage.roots + raised * UP), raised


def add_steps(
    character: Character, before: Passage, after: Passage, cut: Cut, joined: Passage
) -> tuple[Passage, tuple[JoinStep, ...]]:
    """Return a joined passage with contacts that let feet step over the cut, and the steps.

    after: where the cut places it. joined: `blends.join` of both, or a longer passage with the join
    at frame `cut.exit`. A foot that stands more than 5 cm apart on both sides steps, one foot after
    another, the farthest first. A foot that swings before the cut and stands after it lands where
    it has come near the ground and its place.
    """
    end = min(cut.exit + round((LANDING + 2.0 * (SWING + SUPPORT)) * RATE), len(joined))
    left, right = (
        before.part(cut.exit, cut.exit + 1),
        after.part(cut.entry, cut.entry + end - cut.exit),
    )
    made = joined.part(cut.exit, cut.exit + len(right))
    # All at once: for so few poses each call takes longer than the poses.
    every = _balls(character, concatenate(left, right, made))
    own, there, shown = every[0], every[1 : 1 + len(right)], every[1 + len(right) :]
    stands = [_standing(side, at) for side, at in ((before, cut.exit), (after, cut.entry))]
    contacts = joined.contacts.copy()
    landed = cut.exit
    for foot in np.flatnonzero(~stands[0] & stands[1]).tolist():
        last = cut.exit + _landing(shown[:, foot], there[:, foot])
        contacts[cut.exit : last, foot] = 0.0
        landed = max(landed, last)
    apart = _apart(own, there[0])
    must = np.flatnonzero(stands[0] & stands[1] & (np.round(apart, DECIMALS) > FARTHEST))
    steps = []
    for foot in sorted(
        must.tolist(), key=lambda foot: (-round(float(apart[foot]), DECIMALS), foot)
    ):
        step = JoinStep(foot, landed, landed + round(SWING * RATE), float(apart[foot]))
        _swing(contacts, step)
        steps.append(step)
        landed = step.end + round(SUPPORT * RATE)
    return replace(joined, contacts=contacts), tuple(steps)


def _balls(character: Character, passage: Passage) -> Annotated[Floats, "frames feet 3"]:
    """Return the paths of the joints that contact."""
    tips = [leg.tip for leg in character.legs]
    poses = limbs.evaluate_joints(
        character.parents, character.bones, tips, passage.rotations, passage.roots
    )
    balls = [poses.position(tip) for tip in tips]
    return np.stack(balls, axis=1) if balls else np.zeros((len(passage), 0, 3))


def _standing(passage: Passage, frame: int) -> Annotated[Booleans, "feet"]:
    """Return which feet stand in a frame."""
    found: Booleans = np.round(passage.contacts[frame], DECIMALS) > STANDING
    return found


def _apart(
    own: Annotated[Floats, "*#batch 3"], other: Annotated[Floats, "*#batch 3"]
) -> Annotated[Floats, "*batch"]:
    """Return distances over the floor, m."""
    found: Floats = np.abs(floor_plane.project(own) - floor_plane.project(other))
    return found


def _landing(shown: Annotated[Floats, "frames 3"], there: Annotated[Floats, "frames 3"]) -> int:
    """Return the number of frames from a cut to the landing of a foot.

    It lands once its shown path is within 5 cm of the place where it stands after the join, and
    nearly as low; at `LANDING` at the latest.
    """
    count = min(len(shown), len(there), round(LANDING * RATE))
    own, other = shown[:count], there[:count]
    near = (_apart(own, other) <= FARTHEST) & (np.abs(own[:, 1] - other[:, 1]) <= LOW)
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
    """Return the number of frames until a foot stands."""
    standing = np.asarray(contacts) > STANDING
    return int(np.argmax(standing)) if standing.any() else len(standing)
