"""Legs with feet fixed on the floor."""

import numpy as np

from model_export.sample import body, ik, timing
from model_export.sample.controls import Controls
from model_export.sample.trunk import Effort
from service.motion import quat
from service.motion.conventions import UP, Floats
from service.motion.skeleton import Skeleton

_TOE_OUT = 0.12
"""Angle by which each foot points outwards, rad."""

_X = np.array([1.0, 0.0, 0.0])
_FORWARDS = np.array([0.0, 0.0, 1.0])


def _foot_turn(side: str) -> Floats:
    return quat.about(UP, np.array(body.SIDES[side] * _TOE_OUT))


def _ankle(controls: Controls, figure: Skeleton, side: str) -> Floats:
    """Return the fixed position (3,), m, of the ankle.

    It is below the hips when standing, and a thigh's length ahead when sitting.
    """
    thigh = -body.offset(figure, side + "Leg")[1]
    ahead = (1.0 - controls.uprightness) * 0.93 * thigh
    across = 1.15 * body.offset(figure, side + "UpLeg")[0]
    return np.array([across, body.ankle_height(controls.stature), ahead])


def rotations(
    controls: Controls, figure: Skeleton, goal: Effort, pelvis: tuple[Floats, Floats], u: Floats
) -> dict[str, Floats]:
    """Return rotations (P, 4) of both legs under a pelvis of given positions and orientations."""
    return {
        name: turn
        for side in body.SIDES
        for name, turn in _leg(controls, figure, pelvis, side).items()
    } | _toes(goal, u)


def _leg(
    controls: Controls, figure: Skeleton, pelvis: tuple[Floats, Floats], side: str
) -> dict[str, Floats]:
    position, turn = pelvis
    hip = position + quat.rotate(turn, body.offset(figure, side + "UpLeg"))
    back = quat.conj(turn)
    toes = quat.rotate(back, quat.rotate(_foot_turn(side), _FORWARDS))
    thigh, shin = (-body.offset(figure, side + name)[1] for name in ("Leg", "Foot"))
    to_ankle = quat.rotate(back, _ankle(controls, figure, side) - hip)
    # The knee bends half way between the directions of the toes and the pelvis.
    upper, angle = ik.knee(thigh, shin, to_ankle, toes + _FORWARDS)
    bend = quat.about(_X, angle)
    lower = quat.mul(turn, quat.mul(upper, bend))
    foot = quat.mul(quat.conj(lower), _foot_turn(side))
    return {side + "UpLeg": upper, side + "Leg": bend, side + "Foot": foot}


def _toes(goal: Effort, u: Floats) -> dict[str, Floats]:
    """Return rotations (P, 4) of the toes, which lift slightly for a low target."""
    lift = 0.05 + 0.10 * goal.lean
    return {
        "LeftToeBase": quat.about(_X, -lift * (0.4 + 0.6 * timing.trunk(u))),
        "RightToeBase": quat.about(_X, -0.8 * lift * (0.4 + 0.6 * timing.shoulder(u))),
    }
