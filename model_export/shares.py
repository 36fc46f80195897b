"""How far each joint of a clip left out lies from what the others predict, beside all joints."""

import numpy as np

from model_export import fidelity, travel
from model_export.hosvd import Multilinear
from model_export.tensor import MotionTensor
from service.motion.conventions import Floats

# Joints never err by less than this share: nothing is certain.
LEAST = 0.01


def of_joints(
    own_tensor: MotionTensor,
    full: Multilinear,
    parents: tuple[int, ...],
    offsets: Floats,
    residuals: dict[str, Floats],
) -> Floats:
    """Root-mean-square distance (J,) of each joint, as a share of that of all joints.

    offsets (N, J, 3), m: of each clip. residuals: of the pose's field and, for a cycle, of its
    travel, left out (N, m). Distances are true ones, by forward kinematics.
    """
    captured = own_tensor.values
    predicted = captured - full.slices(residuals["pose"])
    apart = fidelity.positions(own_tensor, captured, parents, offsets)
    apart -= fidelity.positions(own_tensor, predicted, parents, offsets)
    squares = np.mean(np.sum(np.square(apart), axis=-1), axis=(0, 1))
    if "travel" in residuals:
        squares += np.mean(travel.spread(residuals["travel"]))
    every = np.mean(squares)
    return np.maximum(np.sqrt(squares / every), LEAST) if every > 0 else np.ones_like(squares)
