"""The reaching arm, the balancing arm and their hands, and legs with feet fixed on the floor.

Angles are those of the right arm. The left arm is its mirror image: x keeps its sign, y and z
change theirs. A positive angle about z lowers the arm and curls a finger, about y it brings arm and
forearm forwards, about x it turns the palm from inwards to down.
"""

from dataclasses import dataclass

import numpy as np

from posefield.common.units import UP, Floats
from posefield.motion import quat
from posefield.motion.skeleton import Skeleton
from posefield_train.sample import sample_body, sample_controls
from posefield_train.sample.sample_controls import SampleControls
from posefield_train.sample.sample_trunk import TrunkDisplacement


def _direction(v: Floats) -> Floats:
    unit: Floats = v / np.linalg.norm(v, axis=-1, keepdims=True)
    return unit


def _frame(along: Floats, side: Floats) -> Floats:
    """Return orthonormal columns (..., 3, 3): along, side's part normal to it, their product."""
    first = _direction(along)
    second = _direction(side - np.sum(side * first, axis=-1, keepdims=True) * first)
    return np.stack([first, second, np.cross(first, second)], axis=-1)


def align(along: Floats, side: Floats, to_along: Floats, to_side: Floats) -> Floats:
    """Return the rotation (..., 4) of one vector onto another that keeps a second on its side.

    `along` maps to the direction of `to_along`, `side` into the half plane of `to_side`.
    """
    here, there = _frame(along, side), _frame(to_along, to_side)
    return quat.from_matrix(there @ np.swapaxes(here, -1, -2))


def knee(
    thigh: float, shin: float, hip_to_ankle: Floats, forwards: Floats
) -> tuple[Floats, Floats]:
    """Return the rotation (..., 4) of the hip and the angle (...), rad, of the knee about x.

    Both bones lie along -y at rest. hip_to_ankle, forwards: (..., 3), in the parent's frame; the
    knee bends towards `forwards`.
    """
    reach = np.sum(hip_to_ankle**2, axis=-1)
    angle = np.arccos((reach - thigh**2 - shin**2) / (2.0 * thigh * shin))
    zero = np.zeros_like(angle)
    ankle = np.stack([zero, -thigh - shin * np.cos(angle), -shin * np.sin(angle)], axis=-1)
    return align(ankle, np.array([0.0, 0.0, 1.0]), hip_to_ankle, forwards), angle


def elbow(upper: float, palm: Floats, reach: float) -> float:
    """Return the angle about y, rad, of a right elbow that puts the palm at a distance `reach`.

    upper: length of the upper arm, along -x. palm: (3,), in the forearm's frame. reach: from the
    shoulder to the palm. The palm can lie off the forearm's axis, which adds a constant angle to
    the law of cosines.
    """
    lag = np.arctan2(palm[2], -palm[0])
    level = np.hypot(palm[0], palm[2])
    cosine = (reach**2 - upper**2 - palm @ palm) / (2.0 * upper * level)
    return float(np.arccos(cosine) - lag)


_MIRROR = {side: np.array([1.0, -sign, -sign]) for side, sign in sample_body.SIDES.items()}

_ELBOW_SIDE = np.array([-0.68, -0.70, -0.22])
"""Direction of the right elbow in the chest's frame: outwards, down and a little back."""

_CLOSED_FINGERS = {
    "Thumb1": (0.30, -0.50, 0.20),
    "Thumb2": (0.10, -0.25, 0.60),
    "Index1": (0.04, 0.10, 0.80),
    "Middle1": (0.02, 0.03, 0.95),
    "Pinky1": (-0.05, -0.12, 1.10),
}
"""Twist, spread and curl of a closed finger, rad."""


@dataclass(frozen=True)
class ArmPose:
    """Pose of an arm.

    blade: Euler angles (..., 3) of the shoulder blade. upper: rotation (..., 4) of the upper arm.
    flexion: of the elbow (...). pronation: of the forearm (...). wrist: Euler angles (..., 3).
    Angles in rad.
    """

    blade: Floats
    upper: Floats
    flexion: Floats
    pronation: Floats
    wrist: Floats


def _forearm(flexion: Floats, pronation: Floats) -> Floats:
    return quat.from_euler(np.stack([flexion, pronation], axis=-1), "YX")


def _by_joint(pose: ArmPose, side: str) -> dict[str, Floats]:
    mirror = np.concatenate([[1.0], _MIRROR[side]])
    return {
        side + "Shoulder": mirror * quat.from_euler(pose.blade, "ZYX"),
        side + "Arm": mirror * pose.upper,
        side + "ForeArm": mirror * _forearm(pose.flexion, pose.pronation),
        side + "Hand": mirror * quat.from_euler(pose.wrist, "ZYX"),
    }


def _resting_pose(controls: SampleControls) -> ArmPose:
    """Return the arm at rest: beside the body when standing, hand on the thigh when sitting."""
    sitting = 1.0 - controls.uprightness
    hanging = quat.from_euler(np.array([-0.05 - 0.25 * sitting, 1.33 - 0.06 * sitting]), "XZ")
    return ArmPose(
        blade=np.array([0.02, 0.0, 0.0]),
        upper=hanging,
        flexion=np.array(0.30 + 0.85 * sitting),
        pronation=np.array(0.25 + 0.45 * sitting),
        wrist=np.array([-0.05 - 0.10 * sitting, 0.0, 0.0]),
    )


def blade(controls: SampleControls, goal: TrunkDisplacement, u: Floats) -> Floats:
    """Return rotations (P, 4) of the right shoulder blade, which moves the root of the arm."""
    end = np.array([0.35 * goal.low - 0.06, 0.14 + 0.06 * controls.azimuth, 0.08 * goal.low])
    return quat.from_euler(
        _blend(_resting_pose(controls).blade, end, sample_controls.shoulder(u)), "ZYX"
    )


def _blend(start: Floats, end: Floats, progress: Floats) -> Floats:
    return start + progress[:, None] * (end - start)


def _reaching_pose(
    controls: SampleControls, goal: TrunkDisplacement, figure: Skeleton, to_target: Floats
) -> ArmPose:
    """Return the final pose of the arm, with the palm on the target.

    to_target: from the shoulder (3,), m, in the blade's frame.
    """
    pronation = np.array(0.35 + 0.5 * goal.low)
    wrist = np.array([-0.22 + 0.25 * goal.low, 0.10, 0.04 * controls.azimuth])
    hand, middle = (sample_body.offset(figure, "Right" + name) for name in ("Hand", "Middle1"))
    palm_position = hand + quat.rotate(quat.from_euler(wrist, "ZYX"), 0.5 * middle)
    turned = quat.rotate(quat.from_axis_angle(np.array([1.0, 0.0, 0.0]), pronation), palm_position)
    upper = sample_body.offset(figure, "RightForeArm")
    flexion = np.array(elbow(-upper[0], turned, float(np.linalg.norm(to_target))))
    along = upper + quat.rotate(_forearm(flexion, pronation), palm_position)
    rotation = align(along, upper, to_target, _ELBOW_SIDE)
    return ArmPose(np.zeros(3), rotation, flexion, pronation, wrist)


def right_arm(
    controls: SampleControls,
    goal: TrunkDisplacement,
    figure: Skeleton,
    to_target: Floats,
    u: Floats,
) -> dict[str, Floats]:
    """Return rotations (P, 4) of the reaching arm, without the shoulder blade.

    to_target: (3,), m, from the shoulder to the target at the end, in the shoulder blade's frame.
    """
    start, end = _resting_pose(controls), _reaching_pose(controls, goal, figure, to_target)
    early, late = sample_controls.shoulder(u), sample_controls.elbow(u)
    # The elbow bends on the way, so that the hand does not pass through the body.
    flexion = (
        start.flexion + late * (end.flexion - start.flexion) + 0.3 * sample_controls.bell_curve(u)
    )
    pose = ArmPose(
        blade=np.zeros((len(u), 3)),
        upper=quat.slerp(start.upper, end.upper, early),
        flexion=flexion,
        pronation=start.pronation + late * (end.pronation - start.pronation),
        wrist=_blend(start.wrist, end.wrist, late),
    )
    return {
        name: turn for name, turn in _by_joint(pose, "Right").items() if name != "RightShoulder"
    }


def left_arm(controls: SampleControls, goal: TrunkDisplacement, u: Floats) -> dict[str, Floats]:
    """Return rotations (P, 4) of the balancing arm, which swings out and hangs under a lean."""
    start, progress = _resting_pose(controls), sample_controls.shoulder(u)
    away = 0.10 + 0.12 * goal.lean - 0.08 * controls.azimuth
    swing = quat.from_euler(np.stack([-0.55 * goal.lean * progress, 0.0 * u], axis=-1), "XZ")
    lift = quat.from_euler(np.stack([-away * progress, 0.06 * progress], axis=-1), "ZY")
    pose = ArmPose(
        blade=_blend(start.blade, np.array([-0.03 - 0.05 * goal.low, -0.07, 0.03]), progress),
        upper=quat.mul(swing, quat.mul(lift, start.upper)),
        flexion=start.flexion + 0.20 * sample_controls.elbow(u) + 0.1 * goal.lean * progress,
        pronation=start.pronation + 0.15 * progress,
        wrist=_blend(start.wrist, np.array([0.05, 0.06, 0.05]), sample_controls.elbow(u)),
    )
    return _by_joint(pose, "Left")


def fingers(goal: TrunkDisplacement, u: Floats) -> dict[str, Floats]:
    """Return rotations (P, 4) of all fingers; the right hand opens and finally closes."""
    opening, closing = (
        sample_controls.minimum_jerk(u, 0.2, 0.7),
        sample_controls.minimum_jerk(u, 0.6, 1.0),
    )
    grip = {
        "Left": 0.35 + 0.10 * sample_controls.trunk(u),
        "Right": 0.35 - 0.25 * opening + (0.35 + 0.1 * goal.low) * closing,
    }
    return {
        side + name: quat.from_euler(np.array(ripe) * _MIRROR[side] * closure[:, None], "XYZ")
        for side, closure in grip.items()
        for name, ripe in _CLOSED_FINGERS.items()
    }


def palm_position(positions: Floats) -> Floats:
    """Return the middle of the right hand (..., 3) from joint positions (..., J, 3)."""
    wrist, middle = (
        positions[..., sample_body.INDEX["Right" + name], :] for name in ("Hand", "Middle1")
    )
    return 0.5 * (wrist + middle)


def arm_reach(figure: Skeleton) -> float:
    """Return the distance, m, from the right shoulder to the palm of a straight arm."""
    upper, fore, middle = (
        sample_body.offset(figure, "Right" + name) for name in ("ForeArm", "Hand", "Middle1")
    )
    return float(np.linalg.norm(upper) + np.linalg.norm(fore + 0.5 * middle))


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
    forward = (1.0 - controls.uprightness) * 0.93 * thigh
    across = 1.15 * sample_body.offset(figure, side + "UpLeg")[0]
    return np.array([across, sample_body.ankle_height(controls.stature), forward])


def legs(
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
    upper, angle = knee(thigh, shin, to_ankle, toes + _FORWARDS)
    bend = quat.from_axis_angle(_X, angle)
    lower = quat.mul(turn, quat.mul(upper, bend))
    foot = quat.mul(quat.conj(lower), _foot_turn(side))
    return {side + "UpLeg": upper, side + "Leg": bend, side + "Foot": foot}


def _toes(goal: TrunkDisplacement, u: Floats) -> dict[str, Floats]:
    """Return rotations (P, 4) of the toes, which lift slightly for a low target."""
    lift = 0.05 + 0.10 * goal.lean
    return {
        "LeftToeBase": quat.from_axis_angle(_X, -lift * (0.4 + 0.6 * sample_controls.trunk(u))),
        "RightToeBase": quat.from_axis_angle(
            _X, -0.8 * lift * (0.4 + 0.6 * sample_controls.shoulder(u))
        ),
    }
