"""Tests of poses of one skeleton for another of the same tree."""

from dataclasses import replace

import numpy as np
import pytest

from posefield.motion import quat, skeleton
from posefield.motion.skeleton import Skeleton
from posefield.performance import passage
from posefield.performance.passage import SkeletonsDiffer

# A trunk with two legs of four bones and a head; the toes and the head have end sites.
PARENTS = (-1, 0, 1, 2, 3, 0, 5, 6, 7, 0)
LEG = [[0.1, -0.05, 0.0], [0.0, -0.4, 0.02], [0.0, -0.4, -0.02], [0.0, -0.05, 0.15]]
MIRROR = np.array([-1.0, 1.0, 1.0])
FEET = (4, 8)


def source(names="abcdefghij"):
    offsets = np.array([[0.0, 0.9, 0.0], *LEG, *(MIRROR * LEG), [0.0, 0.5, 0.0]])
    tips = np.array([[0.0, 0.0, 0.05], [0.0, 0.0, 0.05], [0.0, 0.15, 0.0]])
    return Skeleton(tuple(names), PARENTS, offsets, (4, 8, 9), tips)


def turned(own, joint, angle, axis=(0.0, 0.0, 1.0)):
    """The skeleton with a bone turned in the rest pose."""
    offsets = own.offsets.copy()
    offsets[joint] = quat.rotate(
        quat.from_axis_angle(np.array(axis), np.array(angle)), offsets[joint]
    )
    return replace(own, offsets=offsets)


def poses(count=6):
    return quat.normalize(np.random.default_rng(3).normal(size=(count, len(PARENTS), 4)))


def bones_of(own, rotations):
    """Directions of the bones (F, J - 1, 3) in the world."""
    moved = skeleton.translations(own.offsets, np.zeros((len(rotations), 3)))
    found = skeleton.positions(PARENTS, rotations, moved)
    arms = found[:, 1:] - found[:, PARENTS[1:]]
    return arms / np.linalg.norm(arms, axis=-1, keepdims=True)


def test_an_equal_skeleton_keeps_poses_bit_for_bit():
    found = passage.match_skeletons(source(), source("ABCDEFGHIJ"), FEET)
    before = poses()
    assert found.rotations(before) is before
    assert found.notes == (
        "10 of 10 joints have other names, such as 'a' for 'A': joints are matched by their place"
        " in the tree",
    )
    assert passage.match_skeletons(source(), source()).notes == ()


def test_bones_point_as_in_the_source():
    target = turned(turned(source(), 2, 0.2), 6, -0.15, (1.0, 0.0, 0.0))
    found = passage.match_skeletons(source(), target)
    before = poses()
    after = found.rotations(before)
    assert np.allclose(bones_of(target, after), bones_of(source(), before), atol=1e-9)
    # Rotations as they are would not do.
    assert not np.allclose(bones_of(target, before), bones_of(source(), before), atol=0.05)
    assert found.notes == (
        "the rest poses differ by 11.4 degrees at most: bones point as in the source, but for those"
        " of feet, which are flat where they are in the source",
    )


def test_soles_keep_their_turn_from_the_rest_pose():
    target = turned(source(), 4, 0.2, (1.0, 0.0, 0.0))
    before = np.tile(quat.IDENTITY, (1, len(PARENTS), 1))
    flat = passage.match_skeletons(source(), target, FEET)
    assert np.allclose(flat.rotations(before), before)
    tilted = passage.match_skeletons(source(), target)
    assert not np.allclose(tilted.rotations(before), before, atol=0.05)


def test_other_trees_are_refused_in_words():
    other = Skeleton(("a", "b"), (-1, 0), np.ones((2, 3)), (), np.zeros((0, 3)))
    with pytest.raises(SkeletonsDiffer, match="10 joints, expected 2"):
        passage.match_skeletons(source(), other)
    moved = replace(source("ABCDEFGHIJ"), parents=(*PARENTS[:9], 5))
    with pytest.raises(
        SkeletonsDiffer, match="joint 9, 'j', is a child of 'a', expected as 'J' of"
    ):
        passage.match_skeletons(source(), moved)
    with pytest.raises(
        SkeletonsDiffer, match="joint 1, 'b', points 26 degrees away from that at 'b'"
    ):
        passage.match_skeletons(source(), turned(source(), 2, 0.45))
    passage.match_skeletons(source(), turned(source(), 2, 0.34))
