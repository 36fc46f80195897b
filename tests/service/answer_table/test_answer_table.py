"""Tests of tables of answers: points of the grid, what lies between, and the measured errors."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from posefield.answer_table import accuracy, answer_gaps, interpolated_answers, samples
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
def model(styled_path):
    """A walk with performers and styles."""
    return Synthesizer("styled", session.load(styled_path))


@pytest.fixture(scope="module")
def own(model):
    """Its table."""
    return interpolated_answers.build(model.session, ANSWERS)


@pytest.fixture(scope="module")
def errors(model, own):
    """The measured errors of the table."""
    return accuracy.measure(model.session, own)


def asked(model, points, who=None, level=0):
    """Queries at points."""
    found = np.full(len(points), -1) if who is None else np.asarray(who)
    return Queries(np.asarray(points, float), found, level)


def apart(model, one, other):
    """The largest distance between joints of two answers, m."""
    card = model.session.card
    return float(answer_gaps.gaps(card, one, other).max())


def named_controls(model, point):
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
            controls=named_controls(model, point),
            times=times.tolist(),
            performer=performer,
            level=level,
            exact="none",
        )
        exact = synthesize_poses(model, question)
        np.testing.assert_allclose(found.durations[0], exact.trust.duration, rtol=1e-4)
        np.testing.assert_allclose(found.sigmas[0], exact.trust.sigma, atol=1e-4)
        moving = {name: getattr(found, name)[:, :-1] for name in samples.MOVING}
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


def test_poses_in_place_are_those_of_a_clip_in_place(model, own):
    (point,) = model.session.card.sampled_ranges[0][None]
    found = own.interpolate(asked(model, [point]))
    rate = (interpolated_answers.FRAMES - 1) / float(found.durations[0])
    question = ClipQuestion(
        controls=named_controls(model, point), fps=rate, root="in_place", exact="none"
    )
    clip = synthesize_clip(model, question).clip
    count = min(len(clip), interpolated_answers.FRAMES)
    turns = np.abs(np.sum(found.placed_turns[0, :count] * clip.rotations[:count, 0], axis=-1))
    assert np.abs(found.placed_roots[0, :count] - clip.root_path[:count]).max() < NEAR
    assert turns.min() > 1.0 - 1e-4
    # Negative control: the walk travels.
    assert np.abs(found.roots[0, :count] - clip.root_path[:count]).max() > NEAR


def test_other_points_lie_about_as_far_off_as_was_measured(model, own, errors):
    again = accuracy.measure(model.session, own, seed=7)
    assert errors.points == again.points == accuracy.POINTS * len(own.levels)
    for name in ("worst", "beyond", "typical"):
        assert 0.5 < getattr(again, name) / getattr(errors, name) < 2.0
    assert errors.typical < errors.worst
    assert again.support < 0.05


def test_fewer_answers_are_measured_as_further_off(model, errors):
    coarse = accuracy.measure(model.session, interpolated_answers.build(model.session, 1))
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


def test_names_of_one_set_have_rows_and_others_are_open(model, own):
    card = model.session.card
    named = samples.named_set(card)
    assert named is not None
    assert (named.name, len(card.labels)) == ("performer", 2)
    assert own.head["named"] == "performer"
    assert own.answers == len(card.levels) * len(own.grid) * (len(named.names) + 1)
    low, high = card.sampled_ranges
    question = PoseQuestion(
        controls=named_controls(model, 0.5 * (low + high)),
        times=[0.0],
        labels={"style": card.labels[1].names[0]},
        exact="none",
    )
    styled = synthesize_poses(model, question).trust
    found = own.interpolate(asked(model, [0.5 * (low + high)]))
    assert abs(found.durations[0] / styled.duration - 1.0) > 1e-3


def test_the_set_of_performers_is_named_before_others(model):
    card = model.session.card
    performers, styles = card.labels
    assert samples.named_set(replace(card, labels=(styles, performers))) == performers
    assert samples.named_set(replace(card, labels=(styles,))) == styles
    assert samples.named_set(replace(card, labels=())) is None


def test_curves_are_interpolated_as_poses_are(model_file):
    curved = Synthesizer("curves", session.load(model_file("curves")))
    card, found = curved.session.card, interpolated_answers.build(curved.session, 300)
    low, high = card.sampled_ranges
    point = low + 0.37 * (high - low)
    answer = found.interpolate(asked(curved, [point]))
    # At the same shares of the clip: durations differ by some percent.
    length = curved.session.durations(point[None])[0]
    times = np.linspace(0.0, float(length), interpolated_answers.FRAMES)[:-1]
    question = PoseQuestion(
        controls=named_controls(curved, point), times=times.tolist(), exact="none"
    )
    exact = synthesize_poses(curved, question).curves
    span = np.ptp([(each.minimum, each.maximum) for each in card.curves], axis=1)
    assert np.abs((answer.curves[0, :-1] - exact) / span).max() < 0.03
    # Negative control: another point.
    other = found.interpolate(asked(curved, [low]))
    assert np.abs((other.curves[0, :-1] - exact) / span).max() > 0.1
    measured = accuracy.measure(curved.session, found)
    coarse = accuracy.measure(curved.session, interpolated_answers.build(curved.session, 1))
    assert 0.0 < measured.curves < 0.5 * coarse.curves
