"""Dummy roots: joints above the pelvis that carry no motion of the body.

Some tools write a static joint, or one that slides over the floor, above a pelvis with position
channels. Training keeps the translation of the root only, so such a pelvis would be frozen.
"""

from collections.abc import Sequence

import numpy as np

from posefield.common.units import UP
from posefield.motion import quat, skeleton
from posefield.motion.clip import Clip
from posefield.motion.skeleton import Skeleton

STATIC = 1e-6
"""Largest change of a static joint: of its place, m, and of its quaternion's components."""
RIGID = 1e-4
"""Largest change of a translation that counts as rounding, m."""


def count_dummies(clips: Sequence[Clip]) -> int:
    """Return the number of dummy roots of a family's clips, which have one skeleton.

    Each has one child, and is static or slides over the floor: upright and at one height. The
    child of the last moves against it.
    """
    own = clips[0].skeleton
    count = joint = 0
    while own.parents.count(joint) == 1 and joint not in own.tip_joints:
        if not all(_is_dummy(clip, joint) for clip in clips):
            break
        joint += 1
        if any(np.ptp(clip.translations[:, joint], axis=0).max() > RIGID for clip in clips):
            count = joint
    return count


def _is_dummy(clip: Clip, joint: int) -> bool:
    """Return whether a joint is static, or slides over the floor upright and at one height."""
    turns, place = clip.rotations[:, joint], clip.translations[:, joint]
    if max(np.ptp(turns, axis=0).max(), np.ptp(place, axis=0).max()) < STATIC:
        return True
    upright = np.abs(turns[:, [1, 3]]).max() < STATIC
    return bool(upright and np.ptp(place @ UP) < RIGID)


def collapse_roots(clip: Clip, count: int) -> Clip:
    """Return the clip without its first `count` joints; the next one moves in the world as before.

    Each of these joints must have the next joint as its only child.
    """
    if not count:
        return clip
    own = clip.skeleton
    chain = (-1, *range(count))
    places, turns = skeleton.forward_kinematics(
        chain, clip.rotations[:, : count + 1], clip.translations[:, : count + 1]
    )
    rest = own.offsets[count:].copy()
    rest[0] = own.offsets[: count + 1].sum(axis=0)
    smaller = Skeleton(
        own.names[count:],
        (-1, *(parent - count for parent in own.parents[count + 1 :])),
        rest,
        tuple(joint - count for joint in own.tip_joints),
        own.tip_offsets,
    )
    rotations, translations = clip.rotations[:, count:].copy(), clip.translations[:, count:].copy()
    rotations[:, 0], translations[:, 0] = turns[:, -1], places[:, -1]
    return Clip(smaller, quat.normalize(rotations), translations, clip.rate, clip.curves)


def describe(names: Sequence[str], count: int) -> str:
    """Return the note on collapsed roots. names: of all joints before."""
    dummies = " and ".join(map(repr, names[:count]))
    verb = "is a dummy root" if count == 1 else "are dummy roots"
    return f"{dummies} {verb} above {names[count]!r}, which moves on its own and became the root"
