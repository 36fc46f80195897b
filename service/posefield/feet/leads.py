"""Leads: frames in which limbs, feet and the root stay as the motion has them.

A limb whose joint meets an exact target is led there by the motion, and so is a foot, whatever the
plan of the feet is: a kicking foot goes where the kick takes it. Before and after that it is placed
as any other foot.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from posefield.common.array_shapes import Frames, RootPath
from posefield.common.units import Booleans, Floats
from posefield.feet import pelvis, stances
from posefield.feet.limbs import Limb, LimbPoses
from posefield.feet.stances import LIFTED, SHORTEST_CONTACT, UNEVEN, FootPath, Interval
from posefield.motion.foot_contacts import FootContact

# A foot that is led to two places that are farther apart does not stand on both, m.
SAME_PLACE = 1e-3


@dataclass(frozen=True)
class Led:
    """Frames in which parts of a character stay as the motion has them.

    feet: whether each foot of the legs is exactly on its predicted path (K, F). limbs: share (N, F)
    of the path of each kept limb's end that is kept; 1 is exact, at 0 the end moves with the root.
    root: whether the root keeps its height (F,).
    """

    feet: Annotated[Booleans, "feet frames"]
    limbs: Annotated[Floats, "limbs frames"]
    root: Annotated[Booleans, "frames"]

    def room(self, poses: LimbPoses, limbs: Sequence[Limb]) -> tuple[Frames, Frames]:
        """Return how far the pelvis may be raised, and lowered (F,), m, for what is led.

        limbs: the legs, then the kept limbs. Infinite where nothing is led.
        """
        exact = np.concatenate([self.feet, self.limbs == 1.0])
        up, down = (np.where(self.root, 0.0, np.inf) for _ in range(2))
        for limb, frames in zip(limbs, exact, strict=True):
            if frames.any():
                higher, lower = pelvis.room(poses, [limb])
                up = np.minimum(up, np.where(frames, higher, np.inf))
                down = np.minimum(down, np.where(frames, lower, np.inf))
        return up, down


def joined(found: Sequence[Led]) -> Led:
    """Return the leads of motions whose frames lie one after another."""
    feet, limbs = (
        np.concatenate([getattr(own, n) for own in found], axis=1) for n in ("feet", "limbs")
    )
    return Led(feet, limbs, np.concatenate([own.root for own in found]))


def always(feet: int, limbs: int, frames: int) -> Led:
    """Return the leads of a motion in which no foot is led, and kept limbs are all the time."""
    return Led(np.zeros((feet, frames), bool), np.ones((limbs, frames)), np.zeros(frames, bool))


def goals(path: FootPath, led: Annotated[Booleans, "frames"]) -> RootPath:
    """Return where a foot is led (F, 3), m; not a number in other frames."""
    return np.where(led[:, None], path.positions, np.nan)


def lead_stances(
    found: Sequence[Interval], path: FootPath, foot: FootContact, goal: RootPath
) -> list[Interval]:
    """Return the stances of a foot that agree with where it is led.

    goal: (F, 3), m, as of `goals`. Where the foot is led to a point above or below the floor it
    swings, from when it leaves the floor until it is there again, and for the time of half a
    captured swing before and after the point at least. Between two points on the floor it steps.
    """
    exact = np.flatnonzero(~np.isnan(goal[:, 0]))
    if not len(exact):
        return list(found)
    down = stances.mask(found, len(path))
    for frame in exact[np.abs(goal[exact, 1] - foot.height) > UNEVEN].tolist():
        swing = _swing_around(frame, path, foot)
        down[swing.begin : swing.end] = False
    for stance in stances.runs(down, False):
        own = exact[(exact >= stance.begin) & (exact < stance.end)]
        for last, frame in zip(own[:-1].tolist(), own[1:].tolist(), strict=True):
            if np.linalg.norm(goal[frame] - goal[last]) > SAME_PLACE:
                down[min(last + 1, frame - 1) : frame] = False
    shortest = SHORTEST_CONTACT * path.rate
    return [
        own
        for own in stances.runs(down, False)
        if len(own) >= shortest or own.begin == 0 or own.end == len(path)
    ]


def _swing_around(frame: int, path: FootPath, foot: FootContact) -> Interval:
    """Return the frames around one in the air in which a foot swings."""
    half = round(0.5 * foot.swing * path.rate)
    begin, end = max(frame - half, 0), min(frame + half + 1, len(path))
    high = path.heights >= foot.height + LIFTED
    while begin > 0 and high[begin - 1 : frame].all():
        begin -= 1
    while end < len(path) and high[frame : end + 1].all():
        end += 1
    return Interval(begin, end)
