"""Sway of a standing body: small smooth movements of a seed, so that a held pose is not frozen."""

from collections.abc import Mapping
from typing import Annotated

import numpy as np

from posefield.common.array_shapes import Frames, RootPath, Rotations
from posefield.common.units import Floats
from posefield.kriging import philox
from posefield.motion import quat

STREAM = 4
"""Stream of a seed, besides those of takes and details."""
FREQUENCIES = 0.13, 0.23, 0.37, 0.61
"""Of the waves of a movement, Hz; most of the sway of quiet standing is below 0.5 Hz (Winter,
"Human balance and posture control during standing and walking", 1995)."""
ROOT_SWAY = 0.004
"""Standard deviation of the root over the floor, m, forward and to the left."""
ANGLES = {
    "spine": 0.3,
    "chest": 0.3,
    "upperChest": 0.3,
    "neck": 0.6,
    "head": 0.6,
    "leftUpperArm": 0.5,
    "leftLowerArm": 0.5,
    "rightUpperArm": 0.5,
    "rightLowerArm": 0.5,
}
"""Standard deviation of the rotation about each axis, degrees, by role of the joint."""


def add_sway(
    rotations: Rotations,
    roots: RootPath,
    joints: Mapping[str, int],
    envelope: Frames,
    rate: float,
    seed: int,
) -> tuple[Rotations, RootPath]:
    """Return poses (F, J, 4) and roots (F, 3), m, with the sway of a seed.

    joints: by role. envelope: gain (F,) of the sway. rate: frames a second.
    """
    roles = [role for role in ANGLES if role in joints]
    found = waves(len(roots), rate, 2 + 3 * len(ANGLES), seed) * envelope[:, None]
    swayed = roots.copy()
    swayed[:, [2, 0]] += ROOT_SWAY * found[:, :2]
    vectors = found[:, 2:].reshape(len(roots), -1, 3)
    moved = rotations.copy()
    for place, role in enumerate(ANGLES):
        if role in roles:
            turn = quat.exp(np.radians(ANGLES[role]) * vectors[:, place])
            moved[:, joints[role]] = quat.mul(moved[:, joints[role]], turn)
    return moved, swayed


def waves(
    frames: int, rate: float, channels: int, seed: int
) -> Annotated[Floats, "frames channels"]:
    """Return smooth random numbers (F, C) with a mean of zero and a variance of one over seeds.

    rate: frames a second. Each channel is a sum of waves of `FREQUENCIES` with random coefficients.
    """
    angles = 2.0 * np.pi * np.arange(1, frames + 1)[:, None] / rate * np.array(FREQUENCIES)
    basis = np.hstack([np.cos(angles), np.sin(angles)]) / np.sqrt(len(FREQUENCIES))
    found: Floats = basis @ philox.normals(seed, STREAM, 2 * len(FREQUENCIES), channels)
    return found
