"""Tests of clips: validation, times and composition."""

import numpy as np
import pytest

from posefield.motion import clip, quat
from posefield.motion.clip import Clip
from posefield.motion.skeleton import Skeleton

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
