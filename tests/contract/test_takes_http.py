"""Tests of takes and detail over HTTP: answers, caching and errors."""

import numpy as np
import pytest

MODEL = "/v1/models/walk"


@pytest.fixture(scope="module")
def clip(ask):
    """Ask for a clip's JSON with parameters."""
    return lambda **asked: ask("GET", f"{MODEL}/clip.json", params={"fps": 20, **asked})


def apart(a, b):
    """Largest difference of two answers' rotations, over the frames that both have."""
    first, second = (np.array(answer.json()["rotations"]) for answer in (a, b))
    count = min(len(first), len(second))
    return float(np.abs(first[:count] - second[:count]).max())


def test_a_take_is_another_clip_and_has_an_entity_tag_of_its_own(clip):
    mean, zero, take, other = (
        clip(**asked) for asked in ({}, {"take": 0}, {"take": 7}, {"take": 8})
    )
    assert zero.content == mean.content
    assert apart(mean, take) > 1e-3 and apart(take, other) > 1e-3
    assert clip(take=7).content == take.content
    tags = [answer.headers["etag"] for answer in (mean, take, other, clip(take=7, variety=0.3))]
    assert len({*tags}) == 4
    assert take.json()["trust"]["sigma"] == mean.json()["trust"]["sigma"]
    said = {"seed": 7, "variety": 0.7, "detail": False}
    assert take.json()["trust"]["take"] == said and "take" not in mean.json()["trust"]


def crowd_body(**more):
    return {"controls": {"haste": 3.96, "veer": [-200, -200]}, "time": 0.2, **more}


def test_characters_of_a_crowd_have_takes(ask):
    path = f"{MODEL}/crowd.json"
    plain, taken = (ask("POST", path, json=crowd_body(**m)) for m in ({}, {"take": "index"}))
    assert (plain.status_code, taken.status_code) == (200, 200)
    first, second = np.array(taken.json()["rotations"])
    assert np.abs(first - second).max() > 1e-3
    assert len(np.unique(plain.json()["rotations"], axis=0)) == 1
    again = ask("POST", path, json=crowd_body(take=[1, 2]))
    assert again.json()["rotations"] == taken.json()["rotations"]
