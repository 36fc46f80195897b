"""Rest pose that stands: where the root of a skeleton is, so that its soles are on the floor."""

from dataclasses import replace

import numpy as np

from posefield.motion.skeleton import Skeleton
from posefield.roles import joint_recognition

SOLE, ANKLE = 0.028, 0.089
"""Height of the toe joint above the sole, and of the ankle of a foot without toes, per leg length;
as in the mannequin's feet."""


def standing(skeleton: Skeleton) -> Skeleton:
    """Return the skeleton with its root above the origin, and its rest pose on the floor.

    The lowest joint, end site or sole is at the height 0. Engines scale motions by the root's.
    """
    offsets = skeleton.offsets.copy()
    offsets[0] = 0.0
    positions = skeleton.at_rest(offsets)
    tips = positions[list(skeleton.tip_joints)] + skeleton.tip_offsets
    heights = [*positions[:, 1].tolist(), *tips[:, 1].tolist()]
    roles = joint_recognition.roles_of(skeleton.names, skeleton.parents)
    index = {role: skeleton.names.index(name) for role, name in roles.items()}
    for side in ("left", "right"):
        leg = [index.get(side + segment, -1) for segment in ("UpperLeg", "LowerLeg", "Foot")]
        if -1 in leg:
            continue
        length = float(np.linalg.norm(np.diff(positions[leg], axis=0), axis=1).sum())
        toes = index.get(f"{side}Toes")
        if toes is not None:
            heights.append(float(positions[toes, 1]) - SOLE * length)
        elif leg[2] not in (*skeleton.parents, *skeleton.tip_joints):
            heights.append(float(positions[leg[2], 1]) - ANKLE * length)
    offsets[0, 1] = -min(heights)
    return replace(skeleton, offsets=offsets)
