"""A cycle's travel put back into its poses."""

import numpy as np

from service.motion import quat
from service.motion.conventions import UP, Floats


def put_back(rotations: Floats, roots: Floats, gone: Floats) -> tuple[Floats, Floats]:
    """Rotations (..., J, 4) and root positions (..., 3), m, that have gone (..., 3): to the left
    and ahead, m, and turned, rad."""
    moved = roots + gone[..., :2] @ np.eye(3)[[0, 2]]
    turned = rotations.copy()
    turned[..., 0, :] = quat.mul(quat.about(UP, gone[..., 2]), rotations[..., 0, :])
    return turned, moved
