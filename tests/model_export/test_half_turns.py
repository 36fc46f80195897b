"""Tests of the removal of half-turn flips of small joints, a capture artefact."""

import numpy as np
import pytest

from posefield.motion import quat
from posefield.motion.clip import Clip
from posefield.motion.skeleton import Skeleton
from posefield_train.source import canonical

PARENTS = (-1, 0, 1, 2)
OFFSETS = np.array([[0, 0.9, 0], [0, 0.4, 0], [0.3, 0, 0], [0.08, 0, 0]])
JOINTS = Skeleton(("hips", "arm", "hand", "finger"), PARENTS, OFFSETS, (), np.zeros((0, 3)))
AXIS = np.array([1.0, 0.0, 0.0])
HALF_TURN = quat.from_axis_angle(AXIS, np.array(np.pi))
ARM, HAND, FINGER = 1, 2, 3


@pytest.fixture
def smooth(rng):
    """Rotations (50, J, 4) that swing slowly."""
    time = np.linspace(0.0, 3.0, 50)[:, None, None]
    return quat.exp(0.5 * np.sin(time + rng.normal(size=(1, 4, 3))))


@pytest.fixture
def family(rng):
    """Aligned rotations (9, 50, J, 4) that swing about a common mean."""
    time = np.linspace(0.0, 3.0, 50)[:, None, None]
    middle = quat.exp(rng.normal(size=(4, 3)))
    return quat.mul(middle, quat.exp(0.3 * np.sin(time + rng.normal(size=(9, 1, 4, 3)))))


def clip(rotations):
    return Clip(JOINTS, rotations, np.tile(OFFSETS, (len(rotations), 1, 1)), 60.0)


def steps(rotations):
    return np.linalg.norm(quat.log(quat.mul(quat.conj(rotations[:-1]), rotations[1:])), axis=-1)


def apart(a, b):
    """Largest angle between rotations, rad."""
    return np.max(np.linalg.norm(quat.log(quat.mul(quat.conj(a), b)), axis=-1))


def test_jump_of_a_small_joint_is_taken_out(smooth):
    broken = smooth.copy()
    broken[20:, FINGER] = quat.mul(broken[20:, FINGER], HALF_TURN)
    clean, (finding,) = canonical.remove_jumps(clip(broken), 7)
    assert steps(broken).max() > 3.0
    assert steps(clean.rotations).max() < 0.1
    assert apart(clean.rotations[:20], smooth[:20]) < 1e-7
    assert np.array_equal(clean.rotations[:, :FINGER], broken[:, :FINGER])
    assert (finding.kind, finding.joint, finding.clip) == ("jump", FINGER, 7)
    assert abs(finding.angle - np.pi) < 0.1


def test_jump_of_an_arm_is_left_alone(smooth):
    broken = smooth.copy()
    across = quat.from_axis_angle(np.array([0.0, 1.0, 0.0]), np.array(np.pi))
    broken[20:, ARM] = quat.mul(broken[20:, ARM], across)
    clean, findings = canonical.remove_jumps(clip(broken), 0)
    assert np.array_equal(clean.rotations, broken)
    assert findings == []


def test_sign_of_a_quaternion_is_no_jump(smooth):
    signed = smooth.copy()
    signed[20:] *= -1.0
    assert canonical.remove_jumps(clip(signed), 0)[1] == []


@pytest.mark.parametrize("joint", [HAND, FINGER])
def test_clip_half_a_turn_off_is_turned_back(family, joint):
    broken = family.copy()
    broken[4, :, joint] = quat.mul(broken[4, :, joint], HALF_TURN)
    small = canonical.small_joints(PARENTS, OFFSETS)
    clean, (finding,) = canonical.remove_flips(broken, small)
    assert (finding.kind, finding.joint, finding.clip) == ("flip", joint, 4)
    assert abs(finding.angle - np.pi) < 0.5
    # The clip's own middle becomes the family's: it lies within its swing of it.
    assert apart(clean[4, :, joint], family[4, :, joint]) < 1.2
    assert apart(broken[4, :, joint], family[4, :, joint]) > 3.0
    others = np.arange(9) != 4
    assert np.array_equal(clean[others], broken[others])


def test_flip_of_an_arm_is_left_alone(family):
    family[4, :, ARM] = quat.mul(family[4, :, ARM], HALF_TURN)
    clean, findings = canonical.remove_flips(family, canonical.small_joints(PARENTS, OFFSETS))
    assert np.array_equal(clean, family)
    assert findings == []


def test_clip_that_only_passes_half_a_turn_is_no_flip(family):
    sweep = quat.from_axis_angle(AXIS, np.linspace(0.0, 3.0, 50))
    family[4, :, FINGER] = quat.mul(family[4, :, FINGER], sweep)
    assert canonical.remove_flips(family, canonical.small_joints(PARENTS, OFFSETS))[1] == []


def twisted(smooth, joint, frames):
    """The motion with half a turn about a joint's bone, which its child turns back."""
    broken = smooth.copy()
    bone = OFFSETS[joint + 1] / np.linalg.norm(OFFSETS[joint + 1])
    half = quat.from_axis_angle(bone, np.array(np.pi))
    broken[frames, joint] = quat.mul(broken[frames, joint], half)
    broken[frames, joint + 1] = quat.mul(quat.conj(half), broken[frames, joint + 1])
    return broken


def test_a_twist_about_the_bone_moves_to_the_child_and_moves_no_joint(smooth):
    broken = clip(twisted(smooth, ARM, slice(30, None)))
    clean, (finding,) = canonical.move_twists(broken, 7)
    assert steps(broken.rotations)[:, ARM].max() > 3.0
    assert (finding.kind, finding.joint, finding.clip) == ("twist", ARM, 7)
    assert steps(clean.rotations).max() < 0.1
    assert np.abs(clean.positions() - broken.positions()).max() < 1e-12
    # The larger part of the clip is as it was, here before the jump.
    assert apart(clean.rotations[:30], smooth[:30]) < 1e-7
    # Only the twist from the frame before to that after the jump is lost.
    assert apart(clean.rotations, smooth) < 0.2
