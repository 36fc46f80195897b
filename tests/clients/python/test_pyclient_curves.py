"""Curves of answers in the Python client: arrays, or None for a model without curves."""

import msgspec
import numpy as np
import pytest
from posefield_client import numbers
from posefield_client.wire import Reply

TRUST = {
    "model": "face@0123456789abcdef",
    "controls": {"smile": 0.5},
    "performer": None,
    "level": 0,
    "duration": 1.0,
    "sigma": 0.001,
    "warnings": [],
}


def packed(values):
    own = np.ascontiguousarray(values, "<f4")
    return {"dtype": own.dtype.str, "shape": list(own.shape), "data": own.tobytes()}


def answer(**more):
    frames, joints = 3, 2
    plain = {
        "trust": TRUST,
        "times": packed(np.zeros(frames)),
        "rotations": packed(np.zeros((frames, joints, 4))),
        "root_position": packed(np.zeros((frames, 3))),
        "bone_offsets": packed(np.zeros((joints, 3))),
    }
    return msgspec.msgpack.encode(plain | more)


def reply(content):
    return Reply(200, {}, content)


def clip(**more):
    head = {"units": {}, "names": ["a", "b"], "parents": [-1, 0], "rate": 30.0}
    return numbers.clip(reply(answer(**head, **more)))


def test_a_pose_and_a_clip_have_their_curves():
    values = np.arange(6.0).reshape(3, 2)
    pose = numbers.pose(reply(answer(curves=packed(values))))
    assert np.array_equal(pose.curves, values)
    found = clip(curve_names=["jawOpen", "smile"], curves=packed(values))
    assert found.curve_names == ("jawOpen", "smile")
    assert np.array_equal(found.curves, values)


def test_an_answer_without_curves_has_none():
    assert numbers.pose(reply(answer())).curves is None
    assert (clip().curves, clip().curve_names) == (None, ())


@pytest.mark.parametrize("shape", [(2, 2), (3, 3)])
def test_curves_that_do_not_fit_are_refused(shape):
    with pytest.raises(ValueError, match="curves has the shape"):
        clip(curve_names=["jawOpen", "smile"], curves=packed(np.zeros(shape)))


def crowd(**more):
    count, joints = 3, 2
    head = {"model": TRUST["model"], "names": ["a", "b"], "parents": [-1, 0]}
    arrays = {
        "rotations": packed(np.zeros((count, joints, 4))),
        "root_position": packed(np.zeros((count, 3))),
        "bone_offsets": packed(np.zeros((count, joints, 3))),
        "duration": packed(np.ones(count)),
        "sigma": packed(np.ones(count)),
        "levels": {"dtype": "|i1", "shape": [count], "data": bytes(count)},
    }
    plain = {**head, "units": {}, "warnings": [], **arrays, **more}
    return numbers.crowd(reply(msgspec.msgpack.encode(plain)))


def test_a_crowd_has_the_curves_of_each_character_or_none():
    values = np.arange(6.0).reshape(3, 2)
    found = crowd(curve_names=["jawOpen", "smile"], curves=packed(values))
    assert found.curve_names == ("jawOpen", "smile")
    assert np.array_equal(found.curves, values)
    assert (crowd().curves, crowd().curve_names) == (None, ())
    with pytest.raises(ValueError, match="curves has the shape"):
        crowd(curve_names=["jawOpen"], curves=packed(values))
