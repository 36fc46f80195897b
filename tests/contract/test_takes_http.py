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


def test_a_pose_of_a_take_is_that_of_its_clip(ask, clip):
    pose = ask("GET", f"{MODEL}/pose.json", params={"time": 0.2, "take": 7}).json()
    frame = clip(take=7, feet="as_predicted").json()["rotations"][4]
    assert np.abs(np.array(pose["rotations"][0]) - frame).max() < 1e-6
    plain = ask("GET", f"{MODEL}/pose.json", params={"time": 0.2}).json()
    assert np.abs(np.array(plain["rotations"][0]) - frame).max() > 1e-3


@pytest.mark.parametrize(
    ("name", "words", "status", "said"),
    [
        ("take", "-1", 400, "'-1', expected a whole number"),
        ("variety", "1.01", 422, "1.01, expected 0 to 1"),
        ("detail", "yes", 400, "'yes', expected one of true, false"),
    ],
)
def test_bad_words_are_refused(clip, name, words, status, said):
    answer = clip(**{name: words})
    assert answer.status_code == status and said in answer.json()["detail"]
    assert answer.json()["errors"][0]["parameter"] == name


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
