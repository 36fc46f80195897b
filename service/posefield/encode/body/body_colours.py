"""Colours of bodies."""

import numpy as np

from posefield.common.units import Singles
from posefield.encode.body.bone_boxes import TINTS
from posefield.encode.body.skinned_mesh import SkinnedMesh

SKIN, ROUGHNESS = (0.62, 0.64, 0.69), 0.6


def colours(mesh: SkinnedMesh) -> Singles:
    """Return the colours (C, 3) that the tints of a mesh stand for: one for all, or three."""
    found = TINTS if mesh.tints.any() else np.array([SKIN])
    return found.astype(np.float32)
