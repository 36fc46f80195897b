"""How far each joint of a clip left out lies from what the others predict, beside all joints."""

import numpy as np

from model_export import fidelity, travel
from model_export.fidelity import Judge
from model_export.hosvd import Multilinear
from model_export.tune import Tuned
from service.motion.conventions import Floats

# Joints never err by less than this share: nothing is certain.
LEAST = 0.01


def of_joints(judge: Judge, full: Multilinear, pose: Tuned, travels: Floats | None) -> Floats:
    """Root-mean-square distance (J,) of each joint, as a share of that of all joints.

    pose: the field of the whole tensor's motions, whose variances say what is usual of each clip
    left out; travels (N, 3): residuals of a cycle's travel. Distances are true ones, by forward
    kinematics.
    """
    own = judge.own_tensor
    predicted = own.values - full.slices(pose.residuals)
    apart = fidelity.positions(own, predicted, judge.parents, judge.offsets) - judge.whole
    squares = np.mean(np.sum(np.square(apart), axis=-1), axis=1)
    if travels is not None:
        squares += travel.spread(travels)[:, None]
    usual = np.mean(squares / pose.variances[:, None], axis=0)
    every = np.mean(usual)
    return np.maximum(np.sqrt(usual / every), LEAST) if every > 0 else np.ones_like(usual)
