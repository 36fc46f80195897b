"""Extents of the characters of a crowd.

All characters share one body mesh, made for the model's own bones, while each has its own bone
offsets.
"""

from itertools import product

import numpy as np

from posefield.common.units import Floats
from posefield.encode.character import extent
from posefield.encode.character.animation_samples import AnimationSamples
from posefield.encode.character.character import CharacterRig
from posefield.motion import quat
from posefield.motion.crowd_clip import Placement

CORNERS = np.array(list(product((False, True), repeat=3)))


def boxes(rig: CharacterRig, made: AnimationSamples) -> Floats:
    """Return the lowest and highest corner (M, 2, 3) of each motion in its own frame, m."""
    return extent.bounding_boxes(rig.tree, made, rig.bounds.radii_of_others(made.offsets))


def placed_box(placement: Placement, boxes: Floats) -> Floats:
    """Return a box (2, 3) in the world, m, around boxes (N, 2, 3) of placed characters."""
    low, high = boxes[:, 0], boxes[:, 1]
    corners = np.where(CORNERS, high[:, None], low[:, None])
    moved = quat.rotate(placement.turns[:, None], corners) + placement.positions[:, None]
    return extent.enlarged_box(moved.min(axis=(0, 1)), moved.max(axis=(0, 1)))
