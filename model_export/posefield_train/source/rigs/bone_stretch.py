"""Bones that stretch: how far each joint leaves its mean offset, and the likely cause."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from posefield.common.units import Floats
from posefield.motion.clip import Clip
from posefield.motion.skeleton import Skeleton

STRETCH_SHARE = 0.006
"""Largest stretch of a bone as a share of the body's size: 1 cm of an adult."""
FEW_FRAMES = 0.1
"""Share of frames below which a stretch counts as a jump of the solver."""
MANY_BONES = 0.5
"""Share of the bones above which the skeleton as a whole counts as elastic."""


@dataclass(frozen=True)
class Stretch:
    """Largest stretch of a family. clip: index of the clip. distance, limit: m."""

    clip: int
    joint: int
    distance: float
    limit: float
    cause: str

    def sentence(self, joints: Skeleton) -> str:
        """Return the stretch in words, for an error."""
        return (
            f"bones stretch: joint {joints.names[self.joint]!r} moves by up to "
            f"{100 * self.distance:.1f} cm against its parent "
            f"{joints.names[joints.parents[self.joint]]!r}, expected at most "
            f"{100 * self.limit:.2g} cm, because a model keeps each bone's mean length; "
            f"{self.cause}, or say motion.bones = 'stretch' to keep the mean"
        )


def body_size(clip: Clip) -> float:
    """Return the largest extent of the joints in any frame along an axis, m."""
    return float(np.ptp(clip.positions(), axis=1).max())


def find_stretch(clips: Sequence[Clip]) -> Stretch | None:
    """Return the largest stretch of the clips of one skeleton; None if it is within the limit."""
    apart = np.stack([_stretches(clip).max(axis=0) for clip in clips])
    clip, joint = map(int, np.unravel_index(np.argmax(apart), apart.shape))
    limit = STRETCH_SHARE * float(np.median([body_size(each) for each in clips]))
    if apart[clip, joint] <= max(limit, 1e-4):
        return None
    cause = _likely_cause(clips[clip], joint, limit)
    return Stretch(clip, joint, float(apart[clip, joint]), limit, cause)


def _stretches(clip: Clip) -> Annotated[Floats, "frames joints"]:
    """Return the distance (F, J), m, of each joint's offset from its mean; zero for the root."""
    gaps = clip.translations - clip.translations.mean(axis=0)
    gaps[:, 0] = 0.0
    return np.asarray(np.linalg.norm(gaps, axis=-1))


def _likely_cause(clip: Clip, joint: int, limit: float) -> str:
    """Return the likely cause of a joint's stretch, and what to do about it."""
    apart = _stretches(clip)
    own = clip.skeleton
    beyond = apart.max(axis=0) > limit
    if np.mean(apart[:, joint] > limit) < FEW_FRAMES:
        return "it does so in few frames, as after a marker was lost: repair them or cut them off"
    if np.mean(beyond[1:]) > MANY_BONES:
        return "most bones do, as in a solve without a fixed skeleton: solve it with rigid bones"
    if joint not in own.parents:
        return (
            "it has no children, as a prop or a target of inverse kinematics: leave it out with "
            "motion.drop_joints"
        )
    if own.parents[joint] == 0:
        others = [own.names[j] for j, p in enumerate(own.parents) if p == 0 and j != joint]
        beside = f" besides {', '.join(others)}" if others else ""
        return (
            f"it looks like the body's own root{beside}: leave the others out with "
            "motion.drop_joints, so that it becomes the root"
        )
    return "its position channels carry motion: bake it into rotations"
