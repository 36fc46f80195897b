"""The box that a moving body never leaves."""

import numpy as np

from service.encode.body import Bones
from service.motion import quat, skeleton
from service.motion.clip import Clip
from service.motion.conventions import Floats

# Joints and points are rounded to float32 on their own and turned in float32 by readers: a few
# units in the last place of the largest coordinate.
SLACK = 1e-6


def over(clip: Clip, bones: Bones, rest: Floats) -> Floats:
    """Lowest and highest corner (2, 3) of every joint and every bone's box over all frames, m.

    rest (J, 3) are the joint positions at rest. A box lies within its radius of the line between
    its ends, and both ends move with its joint. Rounded outwards to float32.
    """
    positions, turns = skeleton.forward(clip.skeleton.parents, clip.rotations, clip.translations)
    near = bones.starts - rest[bones.joints]
    ends = np.stack([near, near + bones.arms], axis=1)
    moved = quat.rotate(turns[:, bones.joints, None], ends)
    reach = (positions[:, bones.joints, None] + moved).reshape(-1, 3)
    reach = np.concatenate([reach, positions.reshape(-1, 3)])
    radius = float(np.max(bones.radii))
    return outwards(reach.min(axis=0) - radius, reach.max(axis=0) + radius, SLACK)


def outwards(low: Floats, high: Floats, share: float) -> Floats:
    """Corners (..., 2, 3) moved apart by a share of a metre and of the largest coordinate."""
    slack = share * (1.0 + np.maximum(np.abs(low), np.abs(high)))
    return np.stack([low - slack, high + slack], axis=-2)
