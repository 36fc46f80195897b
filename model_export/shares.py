"""Leave-one-out error of each joint relative to that of all joints."""

import numpy as np

from model_export import fidelity, travel
from model_export.fidelity import Judge
from model_export.hosvd import Multilinear
from model_export.tune import Tuned
from service.motion.conventions import Floats

# Least share of a joint, so that its sigma is never zero.
LEAST = 0.01


def of_joints(judge: Judge, full: Multilinear, pose: Tuned, travels: Floats | None) -> Floats:
    """Return the root mean square error (J,) of each joint as a share of that of all joints.

    pose: kriging model of the full tensor's motions; its variances normalize the error of each
    clip. travels: residuals (N, 3) of a cycle's travel. Distances are true ones, by forward
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
