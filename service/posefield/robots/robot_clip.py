"""Motions of robots as clips of a skeleton, and back.

Each hinge is a joint that turns about one axis: its rotation vector has one direction, and so have
all linear combinations of such rotations in the chart of poses. So hinges stay hinges. The skeleton
has Y up and faces +Z; in its rest pose all angles are zero.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated

import numpy as np

from posefield.common.errors import InvalidField
from posefield.common.units import Floats, Positions, Rotations, Vectors
from posefield.motion import quat
from posefield.motion import skeleton as joint_trees
from posefield.motion.clip import Clip
from posefield.motion.skeleton import Skeleton
from posefield.robots.robot import Robot
from posefield.robots.robot_motion import RobotMotion


@dataclass(frozen=True)
class RobotSkeleton:
    """Skeleton of a robot. A body with several hinges has as many joints, the last of its name.

    hinge_joints (H): joint of each hinge. axes (H, 3): unit axes in the skeleton's frame.
    """

    robot: Robot
    skeleton: Skeleton
    hinge_joints: tuple[int, ...]
    axes: Annotated[Floats, "hinges 3"]

    def joint_motion(self, motion: RobotMotion) -> tuple[Rotations, Positions]:
        """Return local rotations (F, J, 4) and translations (F, J, 3), m, of the joints."""
        rotations = np.tile(quat.IDENTITY, (len(motion), len(self.skeleton), 1))
        for hinge, joint in enumerate(self.hinge_joints):
            rotations[:, joint] = quat.from_axis_angle(self.axes[hinge], motion.angles[:, hinge])
        rotations[:, 0, 0] = motion.base_rotations[:, 0]
        rotations[:, 0, 1:] = _to_y_up(motion.base_rotations[:, 1:])
        path = _to_y_up(motion.base_path)
        return rotations, joint_trees.translations(self.skeleton.offsets, path)

    def motion(self, clip: Clip, source: str, loops: bool | None = None) -> RobotMotion:
        """Return the robot's motion of a clip of its skeleton; source, loops: of a RobotMotion.

        An angle is taken between turns of the whole circle that lies nearest to its range.
        """
        angles = np.stack(
            [
                np.unwrap(quat.twist(clip.rotations[:, joint], axis))
                for joint, axis in zip(self.hinge_joints, self.axes, strict=True)
            ],
            axis=-1,
        )
        middles = self.robot.ranges.mean(axis=1)
        turns = np.round((angles.mean(axis=0) - middles) / (2.0 * np.pi))
        base = clip.rotations[:, 0]
        rotations = np.concatenate([base[:, :1], _to_z_up(base[:, 1:])], axis=-1)
        path, angles = _to_z_up(clip.root_path), angles - 2.0 * np.pi * turns
        hinges = self.robot.hinges
        return RobotMotion(source, "clip", path, rotations, angles, clip.rate, hinges, loops)


def require(robot: Robot | None, name: str) -> Robot:
    """Return the robot of a model or a clip; InvalidField if it is of none.

    name: of the format of reference motions.
    """
    if robot is None:
        raise InvalidField(
            "format",
            f"{name!r} is a reference motion of a robot, and this is a motion of none: expected a "
            "clip of a model whose recipe has [robot]",
        )
    return robot


@lru_cache(maxsize=16)
def of(robot: Robot) -> RobotSkeleton:
    """Return the skeleton of a robot: a joint at each hinge, and at each body without one."""
    still = np.zeros((1, len(robot.hinges)))
    positions, rest = robot.body_poses(np.zeros((1, 3)), quat.IDENTITY[None], still)
    names, parents, places = list[str](), list[int](), list[Floats]()
    hinge_joints, body_joints = dict[int, int](), list[int]()
    for body, name in enumerate(robot.bodies):
        hinges = [hinge for hinge, hinged in enumerate(robot.hinge_bodies) if hinged == body]
        hinges = hinges or [-1]
        parent = body_joints[robot.parents[body]] if body else -1
        for hinge in hinges:
            anchor = robot.anchors[hinge] if hinge >= 0 else np.zeros(3)
            parents.append(parent)
            names.append(name if hinge == hinges[-1] else robot.hinges[hinge])
            places.append(positions[0, body] + quat.rotate(rest[0, body], anchor))
            parent = len(names) - 1
            hinge_joints[hinge] = parent
        body_joints.append(parent)
    at_rest = _to_y_up(np.array(places))
    offsets = at_rest - at_rest[np.maximum(parents, 0)]
    bodies = np.array(robot.hinge_bodies, dtype=int)
    axes = _to_y_up(quat.rotate(rest[0, bodies], robot.axes))
    skeleton = Skeleton(tuple(names), tuple(parents), offsets, (), np.empty((0, 3)))
    joints = tuple(hinge_joints[hinge] for hinge in range(len(robot.hinges)))
    return RobotSkeleton(robot, skeleton, joints, axes)


def _to_y_up(vectors: Vectors) -> Vectors:
    """Return vectors with X ahead and Z up as vectors with Z ahead and Y up."""
    return vectors[..., [1, 2, 0]]


def _to_z_up(vectors: Vectors) -> Vectors:
    """Return vectors with Z ahead and Y up as vectors with X ahead and Z up."""
    return vectors[..., [2, 0, 1]]
