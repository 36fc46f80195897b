"""The reaching arm, the balancing arm, and their hands.

Angles are those of the right arm. The left arm is its mirror image: x keeps its sign, y and z
change theirs. A positive angle about z lowers the arm and curls a finger, about y it brings arm and
forearm forwards, about x it turns the palm from inwards to down.
"""

from dataclasses import dataclass

import numpy as np

from posefield.common.units import Floats
from posefield.motion import quat
from posefield.motion.skeleton import Skeleton
from posefield_train.sample import reach_timing, sample_body, two_bone_ik
from posefield_train.sample.sample_controls import SampleControls
from posefield_train.sample.sample_trunk import TrunkDisplacement

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
        _blend(_resting_pose(controls).blade, end, reach_timing.shoulder(u)), "ZYX"
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
    flexion = np.array(two_bone_ik.elbow(-upper[0], turned, float(np.linalg.norm(to_target))))
    along = upper + quat.rotate(_forearm(flexion, pronation), palm_position)
    rotation = two_bone_ik.align(along, upper, to_target, _ELBOW_SIDE)
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
    early, late = reach_timing.shoulder(u), reach_timing.elbow(u)
    # The elbow bends on the way, so that the hand does not pass through the body.
    flexion = (
        start.flexion + late * (end.flexion - start.flexion) + 0.3 * reach_timing.bell_curve(u)
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
    start, progress = _resting_pose(controls), reach_timing.shoulder(u)
    away = 0.10 + 0.12 * goal.lean - 0.08 * controls.azimuth
    swing = quat.from_euler(np.stack([-0.55 * goal.lean * progress, 0.0 * u], axis=-1), "XZ")
    lift = quat.from_euler(np.stack([-away * progress, 0.06 * progress], axis=-1), "ZY")
    pose = ArmPose(
        blade=_blend(start.blade, np.array([-0.03 - 0.05 * goal.low, -0.07, 0.03]), progress),
        upper=quat.mul(swing, quat.mul(lift, start.upper)),
        flexion=start.flexion + 0.20 * reach_timing.elbow(u) + 0.1 * goal.lean * progress,
        pronation=start.pronation + 0.15 * progress,
        wrist=_blend(start.wrist, np.array([0.05, 0.06, 0.05]), reach_timing.elbow(u)),
    )
    return _by_joint(pose, "Left")


def fingers(goal: TrunkDisplacement, u: Floats) -> dict[str, Floats]:
    """Return rotations (P, 4) of all fingers; the right hand opens and finally closes."""
    opening, closing = (
        reach_timing.minimum_jerk(u, 0.2, 0.7),
        reach_timing.minimum_jerk(u, 0.6, 1.0),
    )
    grip = {
        "Left": 0.35 + 0.10 * reach_timing.trunk(u),
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
