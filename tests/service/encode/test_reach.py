"""Boxes of many motions against every joint and every end that is drawn, in float64."""

from dataclasses import replace

import crowds
import numpy as np
import pytest

from service.encode import body, character, moves
from service.encode.crowd import reach
from service.motion import quat, skeleton
from service.motion.crowd import Placement
from service.motion.skeleton import Skeleton


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
    """Lowest and highest corner (M, 2, 3) of joints and ends of boxes, without their thickness."""
    local = skeleton.translations(made.bone_offsets, made.root_position)
    places, turns = skeleton.forward(person.parents, made.rotations.astype(float), local)
    boxes, joints = body.boxes(person, rig.bones, person.offsets), rig.bones.joints
    starts = boxes.starts - person.at_rest(person.offsets)[joints]
    ends = np.stack([starts, starts + boxes.arms])[:, None, None]
    drawn = places[:, :, joints] + quat.rotate(turns[:, :, joints], ends)
    points = np.concatenate([places, *drawn], axis=-2).reshape(len(made), -1, 3)
    return np.stack([points.min(axis=1), points.max(axis=1)], axis=1)


def holds(hull, seed):
    person, rig, made = case(seed)
    found, least = reach.boxes(hull(rig), moves.of_motions(made)), reached(person, rig, made)
    return np.all(found[:, 0] <= least[:, 0]) and np.all(found[:, 1] >= least[:, 1])


def whole(rig):
    return reach.hull(rig)


def joints_alone(rig):
    found = whole(rig)
    return replace(found, ends=0 * found.ends, radii=0 * found.radii, moved=found.moved & False)


@pytest.mark.parametrize("seed", range(12))
def test_no_joint_and_no_end_leaves_its_box(seed):
    assert holds(whole, seed)


def test_joints_alone_would_not_do():
    assert not any(holds(joints_alone, seed) for seed in range(12))


def test_placed_boxes_hold_their_corners_wherever_they_stand():
    rng = np.random.default_rng(4)
    own = np.sort(rng.uniform(-1, 1, (6, 2, 3)), axis=1)
    placement = Placement(rng.uniform(-9, 9, (6, 3)), rng.uniform(-9, 9, 6))
    low, high = reach.placed(placement, own)
    for box, turn, at in zip(own, placement.turns, placement.positions, strict=True):
        inside = rng.uniform(box[0], box[1], (200, 3))
        moved = quat.rotate(turn, inside) + at
        assert np.all(moved >= low) and np.all(moved <= high)
    assert np.all(high - low < 18 + 2 * np.sqrt(2))
