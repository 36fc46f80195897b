"""Tests of tables of answers: points of the grid, what lies between, and the measured errors."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from posefield.answer_table import accuracy, interpolated_answers, samples
from posefield.answer_table.samples import Queries
from posefield.inference import session
from posefield.question.motion_question import ClipQuestion, PoseQuestion
from posefield.synthesis.clips import synthesize_clip
from posefield.synthesis.poses import synthesize_poses
from posefield.synthesis.synthesizer import Synthesizer

NEAR = 0.01
"""Error of compression at a point of the grid, m."""
ANSWERS = 600


@pytest.fixture(scope="module")
def model(labelled_path):
    """A model with performers."""
    return Synthesizer("labelled", session.load(labelled_path))


@pytest.fixture(scope="module")
def own(model):
    """Its smallest table."""
    return interpolated_answers.build(model.session, 1)


@pytest.fixture(scope="module")
def walk(walk_path):
    """A model that travels."""
    return Synthesizer("walk", session.load(walk_path))


@pytest.fixture(scope="module")
def walked(walk):
    """Its table."""
    return interpolated_answers.build(walk.session, ANSWERS)


@pytest.fixture(scope="module")
def errors(walk, walked):
    """The measured errors of the walk's table."""
    return accuracy.measure(walk.session, walked)


def asked(model, points, who=None, level=0):
    """Queries at points."""
    found = np.full(len(points), -1) if who is None else np.asarray(who)
    return Queries(np.asarray(points, float), found, level)


def apart(model, one, other):
    """The largest distance between joints of two answers, m."""
    card = model.session.card
    gaps = interpolated_answers.joint_positions(card, one) - interpolated_answers.joint_positions(
        card, other
    )
    return float(np.linalg.norm(gaps, axis=-1).max())


def named(model, point):
    """A point by the names of the controls."""
    return {
        each.name: float(value)
        for each, value in zip(model.session.card.controls, point, strict=True)
    }


def test_points_of_the_grid_have_the_answers_of_the_service(model, own):
    card = model.session.card
    points = own.grid.points[:: len(own.grid) // 7]
    for row, (point, level) in enumerate(product(points, (0, len(card.levels) - 1))):
        who = row % (len(card.performers) + 1) - 1
        found = own.interpolate(asked(model, [point], [who], level))
        times = np.linspace(0.0, float(found.durations[0]), interpolated_answers.FRAMES)[:-1]
        performer = card.performers[who] if who >= 0 else None
        question = PoseQuestion(
            controls=named(model, point),
            times=times.tolist(),
            performer=performer,
            level=level,
            exact="none",
        )
        exact = synthesize_poses(model, question)
        np.testing.assert_allclose(found.durations[0], exact.trust.duration, rtol=1e-4)
        np.testing.assert_allclose(found.sigmas[0], exact.trust.sigma, atol=1e-4)
        moving = {name: getattr(found, name)[:, :-1] for name in interpolated_answers.MOVING}
        cut = replace(found, **moving)
        service = replace(
            cut,
            rotations=np.float32(exact.rotations)[None],
            roots=np.float32(exact.root_position)[None],
            bones=np.float32(exact.bone_offsets)[None],
        )
        assert apart(model, cut, service) < NEAR


def test_the_comparison_notices_another_point_performer_and_level(model, own):
    card = model.session.card
    low, high = card.sampled_ranges
    one = own.interpolate(asked(model, [low]))
    for other in (
        asked(model, [high]),
        asked(model, [low], level=len(card.levels) - 1),
    ):
        assert apart(model, one, own.interpolate(other)) > NEAR
    performer = own.interpolate(asked(model, [low], [0]))
    assert abs(performer.durations[0] / one.durations[0] - 1.0) > 1e-3


def test_poses_in_place_are_those_of_a_clip_in_place(walk, walked):
    model, own = walk, walked
    (point,) = model.session.card.sampled_ranges[0][None]
    found = own.interpolate(asked(model, [point]))
    rate = (interpolated_answers.FRAMES - 1) / float(found.durations[0])
    question = ClipQuestion(controls=named(model, point), fps=rate, root="in_place", exact="none")
    clip = synthesize_clip(model, question).clip
    count = min(len(clip), interpolated_answers.FRAMES)
    turns = np.abs(np.sum(found.placed_turns[0, :count] * clip.rotations[:count, 0], axis=-1))
    assert np.abs(found.placed_roots[0, :count] - clip.root_path[:count]).max() < NEAR
    assert turns.min() > 1.0 - 1e-4
    # Negative control: the walk travels.
    assert np.abs(found.roots[0, :count] - clip.root_path[:count]).max() > NEAR


def test_other_points_lie_about_as_far_off_as_was_measured(walk, walked, errors):
    again = accuracy.measure(walk.session, walked, seed=7)
    assert errors.points == again.points == accuracy.POINTS * len(walked.levels)
    for name in ("worst", "beyond", "typical"):
        assert 0.5 < getattr(again, name) / getattr(errors, name) < 2.0
    assert errors.typical < errors.worst
    assert again.support < 0.05


def test_fewer_answers_are_measured_as_further_off(walk, errors):
    coarse = accuracy.measure(walk.session, interpolated_answers.build(walk.session, 1))
    assert coarse.worst > 2.0 * errors.worst
    assert coarse.typical > 2.0 * errors.typical


def test_answers_at_the_limits_are_those_far_beyond_them(model, own):
    low, high = model.session.bounds.limits
    far = samples.sample(
        model.session, asked(model, [high + 9.0 * (high - low)]), interpolated_answers.FRAMES
    )
    found = own.interpolate(asked(model, [high]))
    assert apart(model, found, far) < 2.0 * NEAR
    np.testing.assert_allclose(found.durations, far.durations, rtol=1e-4)


def test_support_is_that_of_the_service_at_its_grid(model, own):
    points = own.support_grid.points[:: len(own.support_grid) // 500]
    expected = model.validator.support.supported(points)
    assert own.supported(points).tolist() == expected.tolist()
    assert {True, False} == set(expected.tolist())
