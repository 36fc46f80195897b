"""Tests of the choice of controls that a question omits."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from msgspec import structs

from posefield.inference import session
from posefield.kriging import support
from posefield.question.model_question import WhyQuestion
from posefield.question.motion_question import ClipQuestion, PoseQuestion
from posefield.synthesis import clips, poses
from posefield.synthesis.synthesizer import Synthesizer
from posefield.synthesis.trust import explain_result
from posefield.validation.imputation import ControlImputer, fit_gaussian

NOBODY = np.zeros((1, 0))


@pytest.fixture
def drawn(rng):
    """Draws of a Gaussian of three numbers, and of one that is as good as the second."""
    free = rng.normal(size=(400, 3)) @ np.array([(2.0, 0.5, 0.0), (0.0, 1.0, 0.3), (0.0, 0.0, 0.1)])
    return np.hstack([free + np.array([1.0, -2.0, 30.0]), 5.0 * free[:, 1:2]])


@pytest.fixture(scope="module")
def model(labelled_path):
    return Synthesizer("labelled", session.load(labelled_path))


@pytest.fixture(scope="module")
def card(model):
    return model.session.card


def test_of_several_given_the_others_are_the_conditional_mean(drawn):
    # Least squares on a constant and what is given says the same.
    design = np.column_stack([np.ones(len(drawn)), drawn[:, [0, 2]]])
    by_least_squares = np.linalg.lstsq(design, drawn[:, [1, 3]], rcond=None)[0]
    asked = np.array([1.0, 3.0, 30.2])
    found = fit_gaussian(drawn, shrunk=0.0)({0: 3.0, 2: 30.2})
    assert np.abs(found[[1, 3]] - asked @ by_least_squares).max() < 1e-8
    assert found[0] == 3.0 and found[2] == 30.2


def test_open_controls_are_those_of_one_captured_clip_near_the_given_ones(card):
    chooser = ControlImputer(card)
    captured = {tuple(point[i] for i in (0, 1, 3)): point[2] for point in card.examples}
    own = card.control("turn")
    for turn in np.linspace(own.minimum, own.maximum, 40).tolist():
        found = chooser.impute({"turn": turn}, NOBODY)
        assert found["turn"] == turn
        rest = tuple(value for name, value in found.items() if name != "turn")
        away = abs(captured[rest] - turn)
        nearest = min(abs(point[2] - turn) for point in card.examples)
        assert away <= nearest + support.NEAR * (own.maximum - own.minimum)


def test_a_choice_never_lies_between_two_clusters(card):
    """The chosen hip height is that of sitting or standing; the mean of all lies between them."""
    hips = np.unique([point[1] for point in card.examples])
    below, above = max(itertools.pairwise(hips), key=lambda pair: pair[1] - pair[0])
    chooser = ControlImputer(card)
    for given in ({}, {"turn": 20.0}, {"turn": -3.0}, {"target_height": 1.0}, {"stature": 1.7}):
        hip = chooser.impute(given, NOBODY)["hip_height"]
        assert hip <= below or hip >= above
    # Negative control: a mean of all clips does.
    assert below < fit_gaussian(np.array(card.examples))({2: 20.0})[1] < above


def test_a_performer_who_is_named_is_typical_of_himself(card):
    chooser, who = ControlImputer(card), np.eye(len(card.performers))
    statures = {}
    for i, name in enumerate(card.performers):
        statures[name] = chooser.impute({}, who[i : i + 1])["stature"]
        own = [p[0] for p, mover in zip(card.examples, card.moved_by, strict=True) if mover == i]
        assert abs(statures[name] - np.mean(own)) < 0.05
    assert statures["short"] < statures["middle"] < statures["tall"]


def left_out(model, asked):
    """A question's answer, and that of the whole question with what was chosen."""
    part = clips.synthesize_clip(model, asked)
    whole = clips.synthesize_clip(model, structs.replace(asked, controls=part.trust.controls))
    return part, whole


@pytest.mark.parametrize("given", [{}, {"turn": 20.0}])
@pytest.mark.parametrize("performer", [None, "tall"])
def test_the_answer_is_that_of_the_whole_question(model, given, performer):
    asked = ClipQuestion(controls=given, performer=performer)
    part, whole = left_out(model, asked)
    names = [control.name for control in model.session.card.controls]
    assert part.trust.inferred == tuple(name for name in names if name not in given)
    assert whole.trust.inferred == ()
    assert structs.replace(part.trust, inferred=()) == whole.trust
    for field in ("rotations", "translations"):
        assert getattr(part.clip, field).tobytes() == getattr(whole.clip, field).tobytes()
    turned = structs.replace(asked, controls={**part.trust.controls, "turn": -20.0})
    other = clips.synthesize_clip(model, turned)
    assert other.clip.rotations.tobytes() != whole.clip.rotations.tobytes(), "negative control"


def test_poses_and_reasons_choose_alike(model):
    given = {"target_height": 1.2}
    clip = clips.synthesize_clip(model, ClipQuestion(controls=given)).trust
    pose = poses.synthesize_poses(model, PoseQuestion(controls=given, times=[0.1])).trust
    reasons = explain_result(model, WhyQuestion(controls=given, extrapolate="warn"))
    assert clip.controls == pose.controls == reasons.controls
    assert clip.inferred == pose.inferred == reasons.inferred
    assert clip.inferred == ("stature", "hip_height", "turn")
    whole = explain_result(model, WhyQuestion(controls=clip.controls, extrapolate="warn"))
    assert replace(reasons, inferred=()) == whole


@pytest.fixture
def clusters(rng):
    """Places of sixty clips in two clusters, of forty and of twenty."""
    near = rng.normal((0.0, 0.0), 0.1, (40, 2))
    return np.vstack([near, rng.normal((3.0, 1.0), 0.1, (20, 2))])


def test_the_medoid_has_the_least_sum_of_distances(rng):
    places = rng.normal(size=(30, 3))
    totals = [sum(np.linalg.norm(own - other) for other in places) for own in places]
    assert support.medoid(places) == int(np.argmin(totals))
    # Negative control: the clip nearest to the mean is another one of a skewed family.
    skewed = np.exp(3.0 * places)
    nearest = int(np.argmin(np.linalg.norm(skewed - skewed.mean(axis=0), axis=1)))
    assert support.medoid(skewed) != nearest


def test_a_neighbourhood_holds_the_clips_and_not_the_gap(clusters):
    around = support.neighbourhood(clusters)
    assert all(around.contains(own) for own in clusters)
    middle = 0.5 * (clusters[0] + clusters[50])
    assert not around.contains(middle)


def test_a_point_in_the_gap_is_pulled_in_to_its_own_cluster(clusters):
    around = support.neighbourhood(clusters)
    start, end = clusters[0], 0.6 * clusters[50]
    found = around.pull_in(start, end)
    assert around.contains(found) and not around.contains(found + 1e-3 * (end - start))
    assert np.linalg.norm(found - clusters[:40], axis=1).min() < 0.3
    inside = clusters[0] + 1e-3
    assert around.pull_in(start, inside) is inside
