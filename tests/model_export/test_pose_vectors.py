"""Tests of the conversion of poses to vectors and back, beyond rotations of 180 degrees."""

from dataclasses import replace

import numpy as np
import pytest

from posefield.common.errors import TrainingError
from posefield.motion import quat
from posefield.motion.quat import CHARTS
from posefield_train.tensor import pose_vectors

UP = np.array([0.0, 1.0, 0.0])
TOLERANCE = 1e-12


@pytest.fixture
def rotations(rng):
    """(6, 40, 3, 4), within a third of a turn of a mean of their own."""
    time = np.linspace(0.0, 3.0, 40)[:, None, None]
    swing = quat.exp(0.6 * np.sin(time + rng.normal(size=(6, 1, 3, 3))))
    return quat.mul(quat.exp(rng.normal(size=(3, 3))), swing)


@pytest.fixture
def path(rng):
    return rng.normal(size=(6, 40, 3))


def apart(a, b):
    return np.max(np.abs(quat.to_matrix(a) - quat.to_matrix(b)))


def raised(peak):
    """One joint in five clips that swing up to an angle from where they start and back."""
    bell = np.sin(np.linspace(0.0, np.pi, 80))
    peaks = np.array([0.3, 0.3, 0.3, 0.3, peak])
    return quat.from_axis_angle(UP, peaks[:, None] * bell)[:, :, None]


def test_poses_of_numbers_are_the_poses(rotations, path):
    own, findings = pose_vectors.fit_chart(rotations)
    back, root = own.poses(own.numbers(rotations, path))
    assert apart(back, rotations) < TOLERANCE
    assert np.array_equal(root, path)
    assert findings == []
    other = replace(own, means=own.means[::-1])
    assert apart(other.poses(own.numbers(rotations, path))[0], rotations) > 0.1


def test_quaternion_and_its_negative_are_one_pose(rotations, path, rng):
    own, _ = pose_vectors.fit_chart(rotations)
    signed = rotations * rng.choice([-1.0, 1.0], size=rotations.shape[:-1])[..., None]
    flipped, _ = pose_vectors.fit_chart(signed)
    assert np.max(np.abs(flipped.means - own.means)) < TOLERANCE
    gap = flipped.numbers(signed, path) - own.numbers(rotations, path)
    assert np.max(np.abs(gap)) < TOLERANCE


def test_turn_of_the_whole_family_changes_no_numbers(rotations, path):
    away = rotations.copy()
    away[:, :, 0] = quat.mul(
        quat.from_axis_angle(UP, np.array(np.radians(178.0))), rotations[:, :, 0]
    )
    first, second = pose_vectors.fit_chart(rotations)[0], pose_vectors.fit_chart(away)[0]
    gap = second.numbers(away, path) - first.numbers(rotations, path)
    assert np.max(np.abs(gap)) < 1e-9
    assert np.max(np.abs(first.numbers(away, path) - first.numbers(rotations, path))) > 1.0


def test_arm_past_half_a_turn_is_followed_without_a_jump():
    rotations = raised(1.4 * np.pi)
    own, findings = pose_vectors.fit_chart(rotations)
    numbers = own.numbers(rotations, np.zeros((5, 80, 3)))[..., 3:]
    plain = quat.log(quat.mul(quat.conj(own.means), rotations))[:, :, 0]
    assert own.chart == "stereographic"
    assert np.linalg.norm(np.diff(numbers, axis=1), axis=-1).max() < 0.5
    assert np.linalg.norm(np.diff(plain, axis=1), axis=-1).max() > 5.0
    assert np.linalg.norm(numbers, axis=-1).max() > 4.0, "of half a turn"
    assert (
        apart(own.poses(np.concatenate([np.zeros((5, 80, 3)), numbers], -1))[0], rotations) < 1e-9
    )
    assert [(f.kind, f.joint, f.clip) for f in findings] == [("wrap", 0, 4)]
    # All five clips start at one pose: on one sheet.
    assert np.max(np.abs(numbers[:, 0] - numbers[0, 0])) < TOLERANCE


def test_joint_close_to_half_a_turn_is_named_but_not_changed():
    rotations = raised(1.05 * np.pi)
    own, findings = pose_vectors.fit_chart(rotations)
    assert [(f.kind, f.joint, f.clip) for f in findings] == [("far", 0, 4)]
    assert 0.9 * np.pi < findings[0].angle <= np.pi
    plain = quat.log(quat.mul(quat.conj(own.means), rotations))[:, :, 0]
    numbers = own.numbers(rotations, np.zeros((5, 80, 3)))[..., 3:]
    assert np.array_equal(numbers, CHARTS["stereographic"].numbers(plain))


def spinning(turns):
    """Ten clips of one joint that turns once in one direction, from nothing to an angle."""
    ends = np.linspace(0.5, turns, 10)
    return quat.from_axis_angle(UP, ends[:, None] * np.linspace(-np.pi, np.pi, 120))[:, :, None]


def test_turns_far_beyond_half_a_turn_are_rotation_vectors():
    rotations = spinning(1.8)
    own, _ = pose_vectors.fit_chart(rotations)
    assert own.chart == "rotation_vector"
    path = np.zeros((10, 120, 3))
    numbers = own.numbers(rotations, path)
    assert np.linalg.norm(numbers, axis=-1).max() > pose_vectors.FARTHEST
    assert apart(own.poses(numbers)[0], rotations) < 1e-9
    # Fewer turns are not, and what a stereographic chart cannot hold is refused.
    near, _ = pose_vectors.fit_chart(spinning(1.2))
    assert near.chart == "stereographic"
    said = r"joint 0 turns 3\d\d degrees from its mean rotation, expected at most 342 in the stereo"
    with pytest.raises(TrainingError, match=said):
        replace(near, means=own.means).numbers(spinning(1.97), path)
