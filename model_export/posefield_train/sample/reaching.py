"""Reaching motion as a function of controls and phase.

The trunk determines the final position of the right shoulder, and with it the distance of the
target. The arm's final pose follows by inverse kinematics, and each joint moves there with its own
onset. The legs follow the pelvis by inverse kinematics at every phase.
"""

from dataclasses import dataclass

import numpy as np

from posefield.common.units import Floats
from posefield.motion import quat, skeleton
from posefield.motion.skeleton import Skeleton
from posefield_train.sample import sample_body, sample_limbs, sample_trunk
from posefield_train.sample.sample_controls import SampleControls
from posefield_train.sample.sample_trunk import TrunkDisplacement


@dataclass(frozen=True)
class ReachingMotion:
    """Poses at given phases. figure: skeleton. rotations: (P, J, 4). root_path: (P, 3), m."""

    figure: Skeleton
    rotations: Floats
    root_path: Floats

    def forward(self) -> tuple[Floats, Floats]:
        """Return joint positions (P, J, 3), m, and orientations (P, J, 4)."""
        translations = skeleton.translations(self.figure.offsets, self.root_path)
        return skeleton.forward_kinematics(self.figure.parents, self.rotations, translations)

    def with_rotations(self, turns: dict[str, Floats]) -> "ReachingMotion":
        """Return the motion with the rotations (P, 4) of the named joints replaced."""
        rotations = self.rotations.copy()
        for name, turn in turns.items():
            rotations[:, sample_body.INDEX[name]] = turn
        return ReachingMotion(self.figure, rotations, self.root_path)


def _trunk_motion(controls: SampleControls, goal: TrunkDisplacement, u: Floats) -> ReachingMotion:
    still = np.tile(quat.IDENTITY, (len(u), len(sample_body.NAMES), 1))
    path = sample_trunk.root_path(controls, goal, u)
    turns = sample_trunk.rotations(controls, goal, u)
    turns["RightShoulder"] = sample_limbs.blade(controls, goal, u)
    return ReachingMotion(sample_body.skeleton(controls.stature), still, path).with_rotations(turns)


def _shoulder(carriage: ReachingMotion) -> tuple[Floats, Floats]:
    """Return position (3,) of the right shoulder and orientation (4,) of its blade at the end."""
    positions, turns = carriage.forward()
    return positions[-1, sample_body.INDEX["RightArm"]], turns[
        -1, sample_body.INDEX["RightShoulder"]
    ]


def _target_position(controls: SampleControls, figure: Skeleton, shoulder: Floats) -> Floats:
    """Return the target (3,), m, in the given direction from the origin at a comfortable distance.

    It is nearer if it lies above, below or beside the shoulder, so that the elbow never locks: the
    arm is extended to sqrt(0.68² + w² / 2) of its length, where w of its length are not ahead.
    """
    forward = np.array([np.sin(controls.azimuth), 0.0, np.cos(controls.azimuth)])
    length = sample_limbs.arm_reach(figure)
    above = controls.target_height - shoulder[1]
    sideways = shoulder[2] * forward[0] - shoulder[0] * forward[2]
    distance = shoulder @ forward + np.sqrt((0.68 * length) ** 2 - 0.5 * (above**2 + sideways**2))
    position: Floats = distance * forward + np.array([0.0, controls.target_height, 0.0])
    return position


def target(controls: SampleControls) -> Floats:
    """Return the position of the target (3,), m."""
    end = _trunk_motion(controls, sample_trunk.trunk_displacement(controls), np.ones(1))
    return _target_position(controls, end.figure, _shoulder(end)[0])


def reaching_motion(controls: SampleControls, u: Floats) -> ReachingMotion:
    """Return poses at phases u (P,) in [0, 1]; at 1 the right palm is at the target."""
    goal = sample_trunk.trunk_displacement(controls)
    shoulder, blade = _shoulder(_trunk_motion(controls, goal, np.ones(1)))
    aim = _target_position(controls, sample_body.skeleton(controls.stature), shoulder)
    to_target = quat.rotate(quat.conj(blade), aim - shoulder)
    carriage = _trunk_motion(controls, goal, u)
    positions, turns = carriage.forward()
    pelvis = positions[:, 0], turns[:, 0]
    chest = quat.conj(turns[:, sample_body.INDEX["Spine1"]])
    to_look = quat.rotate(chest, aim - positions[:, sample_body.INDEX["Neck"]])
    return carriage.with_rotations(
        sample_trunk.neck_rotations(to_look, u)
        | sample_limbs.legs(controls, carriage.figure, goal, pelvis, u)
        | sample_limbs.right_arm(controls, goal, carriage.figure, to_target, u)
        | sample_limbs.left_arm(controls, goal, u)
        | sample_limbs.fingers(goal, u)
    )


def hand_travel(controls: SampleControls) -> float:
    """Return the distance, m, from the hand at rest to the target."""
    motion = reaching_motion(controls, np.array([0.0, 1.0]))
    first, last = sample_limbs.palm_position(motion.forward()[0])
    return float(np.linalg.norm(last - first))
