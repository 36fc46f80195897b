"""Tests of skeletons: validation, and forward kinematics against plain matrices."""

from typing import get_args

import numpy as np
import pytest

from posefield.common.errors import InvalidField
from posefield.motion import clip, joint_roles, quat, skeleton
from posefield.motion.clip import Clip
from posefield.motion.joint_roles import NamingConvention
from posefield.motion.skeleton import Skeleton

PARENTS = (-1, 0, 1, 1, 3, 0)
TOLERANCE = 1e-12


def named(parents, **changes):
    count = len(parents)
    given = {
        "names": tuple(f"joint{i}" for i in range(count)),
        "parents": parents,
        "offsets": np.zeros((count, 3)),
        "tip_joints": (),
        "tip_offsets": np.zeros((0, 3)),
    }
    return Skeleton(**{**given, **changes})


@pytest.fixture
def pose(rng):
    """Rotations (7, J, 4) and translations (7, J, 3)."""
    return quat.normalize(rng.normal(size=(7, 6, 4))), rng.normal(size=(7, 6, 3))


def by_matrices(rotations, translations):
    """Positions (F, J, 3) of products of homogeneous matrices."""
    local = np.zeros((*rotations.shape[:2], 4, 4))
    local[..., :3, :3], local[..., :3, 3] = quat.to_matrix(rotations), translations
    local[..., 3, 3] = 1.0
    world = local.copy()
    for joint, parent in enumerate(PARENTS[1:], start=1):
        world[:, joint] = world[:, parent] @ local[:, joint]
    return world[..., :3, 3]


def test_forward_is_the_product_of_matrices_down_the_tree(pose):
    positions, _ = skeleton.forward_kinematics(PARENTS, *pose)
    assert np.max(np.abs(positions - by_matrices(*pose))) < TOLERANCE
    chain = skeleton.forward_kinematics((-1, 0, 1, 2, 3, 4), *pose)[0]
    assert np.max(np.abs(chain - by_matrices(*pose))) > 0.1


def test_orientations_are_those_that_carry_the_children(pose):
    rotations, translations = pose
    positions, orientations = skeleton.forward_kinematics(PARENTS, rotations, translations)
    for joint, parent in enumerate(PARENTS[1:], start=1):
        arm = quat.rotate(orientations[:, parent], translations[:, joint])
        assert np.max(np.abs(positions[:, parent] + arm - positions[:, joint])) < TOLERANCE
        own = quat.rotate(orientations[:, joint], translations[:, joint])
        assert np.max(np.abs(positions[:, parent] + own - positions[:, joint])) > 0.1


def test_poses_in_several_blocks_are_those_one_by_one(rng):
    count = 2 * skeleton.POSES_PER_BLOCK + 1
    rotations = quat.normalize(rng.normal(size=(count, 1, 6, 4)))
    translations = rng.normal(size=(count, 1, 6, 3))
    positions, orientations = skeleton.forward_kinematics(PARENTS, rotations, translations)
    for pose in (0, skeleton.POSES_PER_BLOCK - 1, skeleton.POSES_PER_BLOCK, count - 1):
        alone = skeleton.forward_kinematics(PARENTS, rotations[pose], translations[pose])
        assert np.array_equal(positions[pose], alone[0])
        assert np.array_equal(orientations[pose], alone[1])
    assert not np.array_equal(positions[0], positions[skeleton.POSES_PER_BLOCK])


def test_trees_of_different_size_are_the_same_tree():
    assert named(PARENTS).same_tree(named(PARENTS, offsets=np.ones((6, 3))))
    assert not named(PARENTS).same_tree(named((-1, 0, 1, 1, 3, 1)))
    assert not named(PARENTS).same_tree(named(PARENTS, names=tuple("abcdef")))


@pytest.mark.parametrize(
    ("parents", "changes", "message"),
    [
        ((), {}, "0 names, 0 parents, offsets (0, 3)"),
        ((-1, 0), {"names": ("a", "a")}, "joint names must be unique"),
        ((-1, 1), {}, "the root comes first and every parent before its children"),
        ((-1,), {"tip_joints": (0,)}, "1 tips, offsets (0, 3)"),
    ],
)
def test_broken_tree_is_refused_saying_what_was_found(parents, changes, message):
    with pytest.raises(ValueError) as refusal:
        named(parents, **changes)
    assert str(refusal.value) == message


@pytest.mark.parametrize("count", [0, 1, 7, skeleton.FEW_POSES])
def test_few_poses_are_those_of_many_bit_for_bit(rng, count):
    most = skeleton.FEW_POSES + 1
    many = quat.normalize(rng.normal(size=(most, 6, 4))), rng.normal(size=(most, 6, 3))
    few = tuple(each[:count] for each in many)
    found = skeleton.forward_kinematics(PARENTS, *few)
    for own, expected in zip(found, skeleton.forward_kinematics(PARENTS, *many), strict=True):
        assert own.tobytes() == expected[:count].tobytes()
    assert skeleton.positions(PARENTS, *few).tobytes() == found[0].tobytes()


CHAIN = Skeleton(
    ("root", "arm"),
    (-1, 0),
    np.array([[0.0, 0.9, 0.0], [0.0, 0.3, 0.0]]),
    (1,),
    np.array([[0.0, 0.2, 0.0]]),
)


def still(frames=5, rate=10.0, **changes):
    given = {
        "rotations": np.tile(quat.IDENTITY, (frames, 2, 1)),
        "translations": np.tile(CHAIN.offsets, (frames, 1, 1)),
    }
    return Clip(CHAIN, rate=rate, **{**given, **changes})


def test_positions_follow_the_root_and_its_turn():
    rotations = np.tile(quat.IDENTITY, (3, 2, 1))
    rotations[1:, 0] = quat.from_axis_angle(np.array([0.0, 0.0, 1.0]), np.array(np.pi / 2))
    path = np.array([[0.0, 0.9, 0.0], [1.0, 0.9, 0.0], [2.0, 0.9, 5.0]])
    moving = clip.assemble(CHAIN, rotations, path, CHAIN.offsets, 30.0)
    expected = np.array([[0.0, 1.2, 0.0], [0.7, 0.9, 0.0], [1.7, 0.9, 5.0]])
    assert np.max(np.abs(moving.positions()[:, 1] - expected)) < 1e-12
    assert np.array_equal(moving.positions()[:, 0], path)
    assert np.array_equal(moving.root_path, path)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"rotations": np.zeros((5, 3, 4))}, "rotations (5, 3, 4), expected (frames, 2, 4)"),
        ({"translations": np.zeros((4, 2, 3))}, "translations (4, 2, 3), expected (5, 2, 3)"),
        ({"rate": float("nan")}, "rate nan, expected a positive number"),
    ],
)
def test_broken_clip_is_refused_saying_what_was_expected(changes, message):
    with pytest.raises(ValueError) as refusal:
        still(**changes)
    assert str(refusal.value) == message


CONVENTIONS = [names for names in get_args(NamingConvention) if names != "own"]


def chain(*names):
    count = len(names)
    return Skeleton(names, (-1, *range(count - 1)), np.zeros((count, 3)), (), np.zeros((0, 3)))


def test_every_convention_has_a_name_of_its_own_for_every_role():
    assert set(joint_roles.NAMES_BY_CONVENTION) == set(CONVENTIONS)
    for table in joint_roles.NAMES_BY_CONVENTION.values():
        assert tuple(table) == joint_roles.ROLES
        assert len(set(table.values())) == len(joint_roles.ROLES) == 22


def test_names_that_a_convention_takes_are_left_to_it():
    """CMU's spine is shifted by one: LowerBack, Spine, Spine1 become Spine, Spine1, Spine2."""
    given = chain("Hips", "LowerBack", "Spine", "Spine1", "Neck")
    cast = {"spine": "LowerBack", "chest": "Spine", "upperChest": "Spine1"}
    assert joint_roles.rename_joints(given, cast, "humanik").names == (
        "Hips",
        "Spine",
        "Spine1",
        "Spine2",
        "Neck",
    )


def test_a_joint_whose_name_was_taken_gets_an_ending_that_nobody_has():
    given = chain("hips", "Spine", "Spine_2", "low")
    assert joint_roles.rename_joints(given, {"spine": "low"}, "humanik").names == (
        "hips",
        "Spine_3",
        "Spine_2",
        "Spine",
    )


def test_without_roles_a_convention_is_refused():
    with pytest.raises(InvalidField) as caught:
        joint_roles.rename_joints(chain("a"), {}, "mixamo")
    assert caught.value.field == "names"
    assert "expected 'own': this model's recipe gives its joints no [roles]" in str(caught.value)
