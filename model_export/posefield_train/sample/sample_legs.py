"""Legs with feet fixed on the floor."""

import numpy as np

from posefield.common.units import UP, Floats
from posefield.motion import quat
from posefield.motion.skeleton import Skeleton
from posefield_train.sample import reach_timing, sample_body, two_bone_ik
from posefield_train.sample.sample_controls import SampleControls
from posefield_train.sample.sample_trunk import TrunkDisplacement

_TOE_OUT = 0.12
"""Angle by which each foot points outwards, rad."""

_X = np.array([1.0, 0.0, 0.0])
_FORWARDS = np.array([0.0, 0.0, 1.0])


def _foot_turn(side: str) -> Floats:
    return quat.from_axis_angle(UP, np.array(sample_body.SIDES[side] * _TOE_OUT))


def _ankle(controls: SampleControls, figure: Skeleton, side: str) -> Floats:
    """Return the fixed position (3,), m, of the ankle.

    It is below the hips when standing, and a thigh's length ahead when sitting.
    """
    thigh = -sample_body.offset(figure, side + "Leg")[1]
    ahead = (1.0 - controls.uprightness) * 0.93 * thigh
    across = 1.15 * sample_body.offset(figure, side + "UpLeg")[0]
    return np.array([across, sample_body.ankle_height(controls.stature), ahead])


def rotations(
    controls: SampleControls,
    figure: Skeleton,
    goal: TrunkDisplacement,
    pelvis: tuple[Floats, Floats],
    u: Floats,
) -> dict[str, Floats]:
    """Return rotations (P, 4) of both legs under a pelvis of given positions and orientations."""
    return {
        name: turn
        for side in sample_body.SIDES
        for name, turn in _leg(controls, figure, pelvis, side).items()
    } | _toes(goal, u)


def _leg(
    controls: SampleControls, figure: Skeleton, pelvis: tuple[Floats, Floats], side: str
) -> dict[str, Floats]:
    position, turn = pelvis
    hip = position + quat.rotate(turn, sample_body.offset(figure, side + "UpLeg"))
    back = quat.conj(turn)
    toes = quat.rotate(back, quat.rotate(_foot_turn(side), _FORWARDS))
    thigh, shin = (-sample_body.offset(figure, side + name)[1] for name in ("Leg", "Foot"))
    to_ankle = quat.rotate(back, _ankle(controls, figure, side) - hip)
    # The knee bends half way between the directions of the toes and the pelvis.
    upper, angle = two_bone_ik.knee(thigh, shin, to_ankle, toes + _FORWARDS)
    bend = quat.from_axis_angle(_X, angle)
    lower = quat.mul(turn, quat.mul(upper, bend))
    foot = quat.mul(quat.conj(lower), _foot_turn(side))
    return {side + "UpLeg": upper, side + "Leg": bend, side + "Foot": foot}


def _toes(goal: TrunkDisplacement, u: Floats) -> dict[str, Floats]:
    """Return rotations (P, 4) of the toes, which lift slightly for a low target."""
    lift = 0.05 + 0.10 * goal.lean
    return {
        "LeftToeBase": quat.from_axis_angle(_X, -lift * (0.4 + 0.6 * reach_timing.trunk(u))),
        "RightToeBase": quat.from_axis_angle(
            _X, -0.8 * lift * (0.4 + 0.6 * reach_timing.shoulder(u))
        ),
    }
