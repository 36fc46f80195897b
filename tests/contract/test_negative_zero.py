"""Tests of -0: it gives the same bytes as 0."""

import re

import pytest

MODEL = "/v1/models/reach"
CONTROLS = {"stature": 1.72, "hip_height": 0.9, "turn": 0.0, "target_height": 1.1}
HAND = {"joint": "RightHand", "position": [0.0, 1.1, 0.49], "time": 0.0}
CROWD = {"controls": CONTROLS, "time": [0.0, 0.1], "position": [[0.0, 0.0, 1.0]] * 2}

ZERO = re.compile(r"(?<=[=@:])0(?=[&:,]|$)")
BODIES = {
    "pose.msgpack": {"controls": CONTROLS, "times": [0.0], "targets": [HAND]},
    "clip.json": {"controls": CONTROLS, "start": 0.0},
    "clips.tar": {"format": "npz", "clips": [{"controls": CONTROLS, "targets": [HAND]}]},
    "sigma": {"across": "stature", "along": "hip_height", "controls": {"turn": 0.0}},
    "crowd.json": {**CROWD, "heading": [0.0, 0.0]},
}


def test_a_query_may_say_minus_zero(ask):
    path = f"{MODEL}/clip.json?turn=0&start=0&target=RightHand@0:0,1.1,0.49"
    signed = ZERO.sub("-0.0", path)
    assert signed != path
    assert_same_bytes(ask("GET", path), ask("GET", signed))


@pytest.mark.parametrize("name", BODIES)
def test_a_body_may_say_minus_zero(ask, name):
    asked = BODIES[name]
    assert_same_bytes(
        ask("POST", f"{MODEL}/{name}", json=asked),
        ask("POST", f"{MODEL}/{name}", json=negative(asked)),
    )


def negative(value):
    """The same with -0.0 for each 0.0."""
    if isinstance(value, dict):
        return {name: negative(each) for name, each in value.items()}
    if isinstance(value, list):
        return [negative(each) for each in value]
    return -0.0 if value == 0.0 and isinstance(value, float) else value


def assert_same_bytes(plain, signed):
    assert plain.status_code == signed.status_code == 200, (plain.text, signed.text)
    assert plain.content == signed.content
