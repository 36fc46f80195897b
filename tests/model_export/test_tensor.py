"""Tests of the motion tensor: distances, and reconstruction of poses."""

import numpy as np
import pytest

from posefield.motion import quat, skeleton
from posefield_train.align.time_alignment import AlignedClips
from posefield_train.tensor import motion_tensor

PARENTS = (-1, 0, 1, 2, 1)
BONES = np.array([[0, 0, 0], [0, 0.5, 0], [0.3, 0, 0], [0.25, 0, 0], [0, 0.2, 0.05]])
CLIPS, FRAMES = 8, 30
WEIGHTS = np.array([1.0, 1.0, 1.0, 2.0, 1.0])


def family(rng, size):
    """Aligned clips that swing by about `size` rad and metres; the head (4) never turns."""
    time = np.linspace(0.0, 2.0, FRAMES)[:, None, None]
    swing = size * np.sin(time + rng.normal(size=(CLIPS, 1, 5, 3)))
    swing[:, :, 4] = 0.0
    rotations = quat.mul(quat.exp(rng.normal(size=(5, 3))), quat.exp(swing))
    root = size * np.cos(time[..., 0] + rng.normal(size=(CLIPS, 1, 3))) + [0.0, 0.9, 0.0]
    root[..., 2] = 0.25
    return AlignedClips(rotations, root, np.zeros((CLIPS, 6)), np.ones(CLIPS), 0)


@pytest.fixture
def small(rng):
    return family(rng, 0.02)


@pytest.fixture
def offsets(rng):
    """Bone offsets (N, J, 3) of one performer."""
    return np.tile(BONES, (CLIPS, 1, 1))


def build(aligned, offsets):
    numbers, own_chart, _ = motion_tensor.pose_vectors(aligned, PARENTS, offsets)
    return motion_tensor.build_tensor(numbers, own_chart, PARENTS, offsets, WEIGHTS)


def skin(aligned, offsets):
    """Points (N, T, J, 6, 3) on the skin around every joint."""
    translations = np.repeat(offsets[:, None], FRAMES, axis=1)
    translations[:, :, 0] = aligned.root_path
    positions, turns = skeleton.forward_kinematics(PARENTS, aligned.rotations, translations)
    axes = motion_tensor.SHELL_RADIUS * np.vstack([np.eye(3), -np.eye(3)])
    return positions[..., None, :] + quat.rotate(turns[..., None, :], axes)


def between_pairs(values):
    """Squared distances of all pairs of clips of values (N, …)."""
    flat = values.reshape(CLIPS, -1)
    a, b = np.triu_indices(CLIPS, k=1)
    return np.sum(np.square(flat[a] - flat[b]), axis=1)


def test_distances_in_the_tensor_are_those_of_joints(small, offsets):
    own = build(small, offsets)
    assert np.max(np.abs(own.values.mean(axis=(1, 2)))) < 1e-12, "it is centred"
    true = between_pairs(skin(small, offsets) * np.sqrt(WEIGHTS / 6.0)[:, None, None])
    found = between_pairs(own.values.transpose(2, 1, 0))
    # To first order in 0.02 rad.
    assert np.max(np.abs(found / true - 1.0)) < 0.03
    numbers = own.chart.numbers(small.rotations, small.root_path)
    share = between_pairs(numbers) / true
    assert np.max(np.abs(share / share.mean() - 1.0)) > 0.1
    unweighted = between_pairs(skin(small, offsets) / np.sqrt(6.0))
    assert np.max(np.abs(found / unweighted - 1.0)) > 0.1


def test_rms_of_a_squared_distance_is_that_of_its_joints(small, offsets):
    own = build(small, offsets)
    still = small.root_path + np.array([0.03, 0.0, 0.0])
    moved = own.chart.numbers(small.rotations, still) - own.chart.numbers(
        small.rotations, small.root_path
    )
    squared = np.sum(np.square(moved @ own.whiten.T))
    assert abs(own.rms(np.array(squared)) - 0.03) < 1e-9


def test_constant_degrees_of_freedom_are_left_out_and_come_back(small, offsets):
    own = build(small, offsets)
    numbers = own.chart.numbers(small.rotations, small.root_path)
    # The head's three numbers and the root's third.
    assert own.values.shape == (3 + 15 - 4, FRAMES, CLIPS)
    restored = own.mean + own.values.transpose(2, 1, 0) @ own.unwhiten.T
    assert np.max(np.abs(restored - numbers)) < 1e-9
    assert np.max(np.abs(own.mean - numbers)) > 1e-2
    constant = [2, 15, 16, 17]
    assert np.array_equal(own.whiten[:, constant], np.zeros((14, 4)))
    assert np.array_equal(own.unwhiten[constant], np.zeros((4, 14)))
    assert np.max(np.abs(restored[..., constant] - numbers[..., constant])) < 1e-9
