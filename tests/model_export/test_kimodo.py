"""Tests of Kimodo's files: people with the joints of SOMA, and the robot G1."""

import numpy as np
import pytest

from posefield.common.errors import MotionFileError
from posefield.motion import bvh_writer, quat
from posefield.motion import skeleton as joint_trees
from posefield.motion.clip import Clip
from posefield.motion.skeleton import Skeleton
from posefield.robots import robot_formats
from posefield.robots.file_conventions import Conventions
from posefield.robots.robot_motion import RobotMotion
from posefield.roles import joint_recognition
from posefield_train.robots import robot_file
from posefield_train.source import kimodo, motion_readers
from posefield_train.source.motion_file import ReadOptions

FRAMES = 7
# Two joints of a leg of the G1, one with a rest of its own, which Kimodo's names tell.
LEG = """<mujoco><worldbody><body name="pelvis" pos="0 0 0.8"><freejoint/>
<geom type="sphere" size="0.1"/><body name="left_hip_pitch_link" pos="0 0.06 -0.1">
<joint name="left_hip_pitch_joint" axis="0 1 0"/><geom type="sphere" size="0.05"/>
<body name="left_hip_roll_link" pos="0 0.05 -0.03" quat="0.996 0 -0.087 0">
<joint name="{name}" axis="1 0 0"/><geom type="sphere" size="0.05"/></body></body></body>
</worldbody></mujoco>"""


def person(count):
    """A clip of SOMA's skeleton with so many joints, which turns and moves."""
    draws = np.random.default_rng(count)
    pairs = kimodo.SKELETONS[count]
    names = tuple(name for name, _ in pairs)
    parents = tuple(names.index(parent) if parent else -1 for _, parent in pairs)
    offsets = draws.uniform(-0.2, 0.2, (count, 3))
    offsets[0] = 0.0
    rotations = quat.normalize(quat.IDENTITY + draws.uniform(-0.3, 0.3, (FRAMES, count, 4)))
    path = draws.uniform(0.5, 1.0, (FRAMES, 3))
    skeleton = Skeleton(names, parents, offsets, (), np.zeros((0, 3)))
    return Clip(skeleton, rotations, joint_trees.translations(offsets, path), 30.0)


def saved(path, clip, **changes):
    positions, turns = joint_trees.forward_kinematics(
        clip.skeleton.parents, clip.rotations, clip.translations
    )
    fields = {"posed_joints": positions, "global_rot_mats": quat.to_matrix(turns)}
    np.savez(path, **{**fields, **changes})
    return path


@pytest.mark.parametrize("count", kimodo.SKELETONS)
def test_a_person_of_kimodo_is_read_with_names_and_recognised(count, tmp_path):
    clip = person(count)
    motion = motion_readers.read(saved(tmp_path / "a.npz", clip), ReadOptions(30.0))
    read = Clip(motion.skeleton, motion.rotations, motion.translations, motion.rate)
    np.testing.assert_allclose(read.positions(), clip.positions(), atol=1e-6)
    assert (motion.metres_per_unit, motion.up, motion.rate) == (1.0, "y", 30.0)
    roles = joint_recognition.roles_of(motion.skeleton.names, motion.skeleton.parents)
    # The leg of SOMA is a thigh, and its shin a lower leg.
    assert (roles["leftUpperLeg"], roles["leftLowerLeg"]) == ("LeftLeg", "LeftShin")
    # The same from BVH.
    (tmp_path / "a.bvh").write_bytes(bvh_writer.dumps(clip, metres_per_unit=0.01))
    bvh = motion_readers.read(tmp_path / "a.bvh")
    assert bvh.skeleton.names == motion.skeleton.names
    positions = Clip(bvh.skeleton, bvh.rotations, bvh.translations, bvh.rate).positions()
    np.testing.assert_allclose(0.01 * positions, clip.positions(), atol=1e-4)


def stretched(positions):
    positions[3:, 5] += 0.1
    return positions


BAD = {
    "found 29 joints": lambda clip: {"posed_joints": clip.positions()[:, 1:]},
    "bones change by": lambda clip: {"posed_joints": stretched(clip.positions())},
    "not finite": lambda clip: {"posed_joints": np.full((FRAMES, 30, 3), np.nan)},
    "need a body model": lambda clip: {"poses": np.zeros(3), "trans": np.zeros(3)},
    "34 are the robot G1's": lambda clip: {"posed_joints": np.zeros((FRAMES, 34, 3))},
}


@pytest.mark.parametrize("message", BAD)
def test_other_files_are_refused_with_the_reason(message, tmp_path):
    clip = person(30)
    path = saved(tmp_path / "a.npz", clip, **BAD[message](clip))
    with pytest.raises(MotionFileError, match=message):
        motion_readers.read(path, ReadOptions(30.0))


def test_the_robot_of_kimodo_turns_about_its_hinges(tmp_path):
    (tmp_path / "leg.xml").write_text(LEG.format(name="left_hip_roll_joint"))
    robot = robot_file.read(tmp_path / "leg.xml")
    times = np.arange(FRAMES)
    angles = np.stack([0.5 * np.sin(times), 0.2 * np.cos(times)], axis=-1)
    turning = quat.from_axis_angle(np.array([0.0, 0.0, 1.0]), 0.3 * times)
    path = np.stack([0.1 * times, 0 * times, 0.2 + 0 * times], axis=-1)
    motion = RobotMotion("", "", path, turning, angles, 30.0, robot.hinges)
    positions, rotations = motion.body_poses(robot)
    # The pelvis, then the pitch and roll of the left hip.
    joints = [0, 1, 2]
    fields = {
        "posed_joints": np.zeros((FRAMES, 34, 3)),
        "global_rot_mats": np.zeros((FRAMES, 34, 3, 3)),
    }
    # X ahead and Z up are Z ahead and Y up there.
    fields["posed_joints"][:, joints] = positions[..., [1, 2, 0]]
    fields["global_rot_mats"][:] = np.eye(3)
    matrices = quat.to_matrix(rotations)
    fields["global_rot_mats"][:, joints] = matrices[..., [1, 2, 0], :][..., [1, 2, 0]]
    np.savez(tmp_path / "a.npz", **fields)
    read = robot_formats.read(tmp_path / "a.npz", Conventions(robot, rate=30.0))
    assert read.format == "kimodo.npz"
    np.testing.assert_allclose(read.angles, angles, atol=1e-9)
    np.testing.assert_allclose(read.base_path, path, atol=1e-12)
    alike = np.abs(np.einsum("fk,fk->f", read.base_rotations, turning))
    np.testing.assert_allclose(alike, 1.0, atol=1e-12)
    with pytest.raises(MotionFileError, match="expected the robot too"):
        robot_formats.read(tmp_path / "a.npz", Conventions(rate=30.0))
    (tmp_path / "leg.xml").write_text(LEG.format(name="tail_joint"))
    other = robot_file.read(tmp_path / "leg.xml")
    with pytest.raises(MotionFileError, match=r"'tail_joint' of leg\.xml is none of Kimodo's G1"):
        robot_formats.read(tmp_path / "a.npz", Conventions(other, rate=30.0))
