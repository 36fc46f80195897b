"""Reference poses of motions: upright bodies with flat feet, whatever files have at rest.

Some files are at rest with all bones along one axis, or with feet that point down.
"""

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from posefield.common.array_shapes import Vector
from posefield.common.units import UP, Booleans, Floats
from posefield.motion import quat
from posefield.retarget.foot_paths import FLOOR
from posefield.retarget.planted_legs import PosedRig
from posefield.retarget.role_map import SIDES, Body

UPRIGHT = 0.7
"""Vertical part of the directions of legs and trunk at rest from which on a body stands."""
SAME_SLOPE = np.radians(10.0)
"""Difference of the slopes of two feet at rest up to which both are taken as flat."""
FLAT_SHARE = 30.0
"""Percentile of the heights of an ankle in stances up to which its foot is flat."""


def with_upright_rest(motion: PosedRig) -> PosedRig:
    """Return a motion whose body is at rest as in its most upright frame, if its own rest is not.

    Positions stay; orientations are those against the new rest.
    """
    if is_upright(motion.body):
        return motion
    joints = motion.body.joints
    feet = 0.5 * (motion.of_role("leftFoot") + motion.of_role("rightFoot"))
    top = motion.of_role(next(role for role in ("neck", "head", "hips") if role in joints))
    frame = int(np.argmax(np.round((top - feet) @ UP, 4)))
    places = motion.places[frame]
    bones = places - places[list(motion.body.parents)]
    bones[0] = places[0]
    turns = quat.mul(motion.turns, quat.conj(motion.turns[frame]))
    return replace(motion, body=replace(motion.body, bones=bones), turns=turns)


def is_upright(body: Body) -> bool:
    """Return whether a body stands at rest: legs below the hips, the trunk above."""
    ways = [body.direction(side + "Foot", side + "UpperLeg") for side in SIDES]
    top = next((role for role in ("neck", "head") if role in body.joints), None)
    ways += [] if top is None else [body.direction("hips", top)]
    across = body.direction("rightUpperLeg", "leftUpperLeg") * FLOOR
    return min(way @ UP for way in ways) > UPRIGHT and float(np.linalg.norm(across)) > UPRIGHT


@dataclass(frozen=True)
class Sole:
    """Foot of a body at rest.

    toes (3,): from the ankle to the toes, m; zero without them. pitch: by which the foot is turned
    for its sole to be flat, rad, toes upwards.
    """

    toes: Vector
    pitch: float = 0.0

    @property
    def slope(self) -> float:
        """Return the angle of the toes above the ankle at rest, rad."""
        return float(np.arctan2(self.toes @ UP, np.linalg.norm(self.toes * FLOOR)))

    @property
    def flattening(self) -> Floats:
        """Return the rotation (4,) that makes the sole flat."""
        ahead = self.toes * FLOOR / max(float(np.linalg.norm(self.toes * FLOOR)), 1e-9)
        return quat.from_axis_angle(quat.cross(ahead, UP), np.array(self.pitch))

    @property
    def flat_toes(self) -> Vector:
        """Return the vector (3,), m, from the ankle to the toes of the flat foot."""
        found: Vector = quat.rotate(self.flattening, self.toes)
        return found


def sole_at_rest(body: Body, side: str) -> Sole:
    """Return the sole of a foot that is flat at rest."""
    ankle, tip = body.joints[side + "Foot"], body.joints.get(side + "Toes")
    return Sole(np.zeros(3) if tip is None else body.rest[tip] - body.rest[ankle])


def sole_of_motion(
    motion: PosedRig, side: str, standing: Annotated[Booleans, "frames"], rig: Sole
) -> Sole:
    """Return the sole of a foot of a motion, flat as it is while it stands with a low ankle.

    standing (F,): whether the foot stands. rig: the sole to be compared; one of the same slope at
    rest is flat at rest too, as is a foot that never stands or has no toes.
    """
    found = sole_at_rest(motion.body, side)
    is_same = abs(found.slope - rig.slope) <= SAME_SLOPE
    if not standing.any() or not found.toes.any() or not rig.toes.any() or is_same:
        return found
    ankles, toes = motion.of_role(side + "Foot")[standing], motion.of_role(side + "Toes")[standing]
    heights = ankles @ UP
    low = heights <= np.percentile(heights, FLAT_SHARE)
    apart = (toes - ankles)[low]
    slopes = np.arctan2(apart @ UP, np.linalg.norm(apart * FLOOR, axis=-1))
    return replace(found, pitch=float(np.median(slopes)) - found.slope)
