"""Tests of bounding boxes of motions against all joints and drawn ends, in float64."""

from dataclasses import replace

import crowds
import numpy as np
import pytest

from posefield.encode import character, crowd_scene, extent
from posefield.encode import extent as exact
from posefield.motion import clip as clips
from posefield.motion import quat, skeleton
from posefield.motion.clip import Placement
from posefield.motion.skeleton import Skeleton


def tree(seed):
    """A random skeleton, some of whose joints hold tips and some lie where others do."""
    rng = np.random.default_rng(seed)
    joints = int(rng.integers(2, 25))
    parents = (-1, *(int(rng.integers(0, joint)) for joint in range(1, joints)))
    offsets = rng.uniform(-0.4, 0.4, (joints, 3)) * rng.integers(0, 2, (joints, 1))
    offsets[1] = (0.1, 0.4, 0.0)
    tips = tuple(int(tip) for tip in rng.integers(0, joints, 4))
    labels = tuple(f"j{joint}" for joint in range(joints))
    return Skeleton(labels, parents, offsets, tips, rng.uniform(-0.2, 0.2, (4, 3)))


def case(seed):
    person = tree(seed)
    made = crowds.motions(person, 3, 20, seed)
    # Far away float32 keeps less.
    made.root_position[1] += 500
    return person, character.rig(person), made


def reached(person, rig, made):
    """Lowest and highest corner (M, 2, 3) of joints and of all points of the skinned body."""
    local = skeleton.translations(made.bone_offsets, made.root_position)
    places, turns = skeleton.forward_kinematics(person.parents, made.rotations.astype(float), local)
    rest, body = person.at_rest(person.offsets), rig.body
    drawn = np.zeros((*places.shape[:2], *body.points.shape))
    for joints, weights in zip(body.joints.T, body.weights.T / 255.0, strict=True):
        moved = places[:, :, joints] + quat.rotate(turns[:, :, joints], body.points - rest[joints])
        drawn += weights[:, None] * moved
    points = np.concatenate([places, drawn], axis=-2).reshape(len(made), -1, 3)
    return np.stack([points.min(axis=1), points.max(axis=1)], axis=1)


def holds(bounded, seed):
    person, rig, made = case(seed)
    found, least = (
        crowd_scene.motion_boxes(bounded(rig), extent.samples_of_motions(made)),
        reached(person, rig, made),
    )
    return np.all(found[:, 0] <= least[:, 0]) and np.all(found[:, 1] >= least[:, 1])


def whole(rig):
    return rig


def joints_alone(rig):
    return replace(rig, bounds=character.rig(rig.skeleton, "none").bounds)


@pytest.mark.parametrize("seed", range(3))
def test_no_joint_and_no_point_leaves_its_box(seed):
    assert holds(whole, seed)


def test_joints_alone_would_not_do():
    assert not any(holds(joints_alone, seed) for seed in range(6))


def test_placed_boxes_hold_their_corners_wherever_they_stand():
    rng = np.random.default_rng(4)
    own = np.sort(rng.uniform(-1, 1, (6, 2, 3)), axis=1)
    placement = Placement(rng.uniform(-9, 9, (6, 3)), rng.uniform(-9, 9, 6))
    low, high = crowd_scene.placed_box(placement, own)
    for box, turn, at in zip(own, placement.turns, placement.positions, strict=True):
        inside = rng.uniform(box[0], box[1], (200, 3))
        moved = quat.rotate(turn, inside) + at
        assert np.all(moved >= low) and np.all(moved <= high)
    assert np.all(high - low < 18 + 2 * np.sqrt(2))


def ragged(seed):
    """Clips of a random skeleton, of several lengths; one is a single pose."""
    person, rng = tree(seed), np.random.default_rng(seed)
    made = []
    for frames in (7, 1, 20, 13):
        turns = quat.normalize(rng.standard_normal((frames, len(person), 4)))
        path = rng.standard_normal((frames, 3)) + 3
        offsets = person.offsets * rng.uniform(0.8, 1.2, (len(person), 1))
        made.append(clips.assemble(person, turns, path, offsets, 30.0))
    return person, made


def places(person, clip):
    """Joints and tips (F, P, 3), in float64."""
    found, turns = skeleton.forward_kinematics(person.parents, clip.rotations, clip.translations)
    holders = list(person.tip_joints)
    return np.concatenate(
        [found, found[:, holders] + quat.rotate(turns[:, holders], person.tip_offsets)], 1
    )


@pytest.mark.parametrize("seed", range(3))
def test_boxes_of_clips_are_exact(seed):
    person, made = ragged(seed)
    rig = character.rig(person)
    none = np.zeros((len(made), len(person) + len(person.tip_joints)))
    found = exact.bounding_boxes(rig.tree, extent.samples_of_clips(made), none)
    for clip, (low, high) in zip(made, found, strict=True):
        every = places(person, clip).reshape(-1, 3)
        for ours, theirs in ((low, every.min(axis=0)), (-high, -every.max(axis=0))):
            assert np.all(ours <= theirs) and np.all(theirs - ours < 1e-4)
