"""Tests of takes of the characters of a crowd."""

import json
from dataclasses import replace

import numpy as np
import pytest

from posefield.common.errors import InvalidField
from posefield.http.decoding import crowd_query
from posefield.inference import reduced_motion, session
from posefield.question.motion_question import PoseQuestion
from posefield.synthesis import crowd_synthesis, poses
from posefield.synthesis.synthesizer import NO_DETAIL, Synthesizer
from posefield.validation import crowd_validation

COUNT, TIME = 6, 0.3


@pytest.fixture(scope="module")
def reach(labelled_path) -> Synthesizer:
    """A model of reaches with performers."""
    return Synthesizer("reach", session.load(labelled_path))


@pytest.fixture(scope="module")
def walk(walk_path) -> Synthesizer:
    """A model of a walk."""
    return Synthesizer("walk", session.load(walk_path))


def question(model, count=COUNT, **asked):
    """A crowd of equal characters in the middle of what was sampled."""
    controls = {c.name: [c.default] * count for c in model.session.card.controls}
    body = {"controls": controls, "time": TIME, **asked}
    return crowd_query.of_body(json.dumps(body).encode(), 1e5)


def crowd(model, **asked):
    return crowd_synthesis.synthesize_crowd(model, question(model, **asked))


def apart(a, b):
    """Largest difference (N,) of the rotations of each character."""
    return np.abs(a.rotations - b.rotations).max(axis=(1, 2))


def test_no_two_characters_of_other_seeds_are_alike(walk):
    plain, taken = crowd(walk), crowd(walk, take="index")
    assert apart(plain, crowd(walk, take=0)).max() == 0.0
    assert apart(plain, taken).min() > 1e-4
    assert apart(taken, crowd(walk, take=[1, 2, 3, 4, 5, 6])).max() == 0.0
    pairs = np.abs(taken.rotations[:, None] - taken.rotations).max(axis=(2, 3))
    assert pairs[~np.eye(COUNT, dtype=bool)].min() > 1e-4
    alike = crowd(walk, take=7).rotations
    assert np.abs(alike - alike[0]).max() < 1e-6
    assert np.array_equal(taken.duration, plain.duration)


def test_a_character_has_the_pose_of_its_take(reach):
    found = crowd(reach, take=[0, 7, 8, 7, 0, 9], variety=[1, 1, 1, 0.5, 1, 1])
    controls = {c.name: c.default for c in reach.session.card.controls}
    for row, (take, variety) in enumerate([(0, 1), (7, 1), (8, 1), (7, 0.5)]):
        asked = PoseQuestion(controls=controls, times=[TIME], take=take, variety=variety)
        pose = poses.synthesize_poses(reach, asked)
        assert np.abs(pose.rotations[0] - found.rotations[row]).max() < 2e-6
        assert np.abs(pose.root_position[0] - found.root_position[row]).max() < 2e-6


def test_detail_is_sampled_by_each_seed(walk):
    opened = walk.session
    stored = reduced_motion.to_bytes(np.full((3, opened.card.levels[0].ranks[0]), 0.01))
    making = replace(opened.card.making, detail=stored)
    detailed = Synthesizer("walk", replace(opened, card=replace(opened.card, making=making)))
    found = crowd(detailed, take="index", detail=True)
    assert apart(found, crowd(walk, take="index")).min() > 1e-3
    assert found.warnings == crowd(walk).warnings
    said = crowd(walk, take="index", detail=True)
    assert said.warnings[-1] == NO_DETAIL
    assert apart(said, crowd(walk, take="index")).max() == 0.0


def test_too_many_takes_are_refused(walk):
    most = crowd_validation.MAX_TAKES
    seeds = [1] * (most + 1)
    with pytest.raises(InvalidField, match=f"take: {most + 1} characters with takes"):
        crowd_synthesis.synthesize_crowd(walk, question(walk, most + 1, take=seeds))
    card = walk.session.card
    spherical = replace(card, kriging=replace(card.kriging, covariance="spherical"))
    with pytest.raises(InvalidField, match="take: given, but no takes can be drawn of spherical"):
        crowd(Synthesizer("walk", replace(walk.session, card=spherical)), take=3)
