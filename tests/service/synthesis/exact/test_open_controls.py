"""Tests of questions with targets instead of controls."""

from dataclasses import replace

import numpy as np
import pytest

from posefield.inference import session
from posefield.motion.measures import Measure
from posefield.question.motion_question import ClipQuestion, Target
from posefield.synthesis import clips
from posefield.synthesis.synthesizer import Synthesizer


@pytest.fixture(scope="module")
def reach(labelled_path) -> Synthesizer:
    """A model of a reach, one of whose controls is where the hand ends."""
    opened = session.load(labelled_path)
    hand = opened.card.skeleton.names.index("RightHand")
    measures = {"target_height": Measure("height", (hand,), "end")}
    controls = tuple(replace(c, measure=measures.get(c.name)) for c in opened.card.controls)
    return Synthesizer("reach", replace(opened, card=replace(opened.card, controls=controls)))


def captured(model, index):
    """Controls of a captured clip, and where the model puts the hand there."""
    card = model.session.card
    controls = {c.name: v for c, v in zip(card.controls, card.examples[index], strict=True)}
    clip = clips.synthesize_clip(
        model, ClipQuestion(controls=controls, fps=200.0, exact="none")
    ).clip
    return controls, clip.positions()[-1, card.skeleton.names.index("RightHand")]


def asked(model, place, joint="RightHand", **given):
    hold = {"targets": (Target(joint, tuple(place), at="end"),)}
    return clips.synthesize_clip(model, ClipQuestion(controls=given, **hold)).trust


def off(model, controls, truth):
    """Distance of those controls from others that a hand tells of, in ranges."""
    ranges = {c.name: c.maximum - c.minimum for c in model.session.card.controls}
    told = ("turn", "target_height")
    return np.linalg.norm([(controls[n] - truth[n]) / ranges[n] for n in told])


def test_controls_are_those_of_motions_that_get_there(reach):
    gains, misses = [], []
    for index in range(0, 46, 5):
        truth, place = captured(reach, index)
        found = asked(reach, place)
        nothing = clips.synthesize_clip(reach, ClipQuestion(controls={})).trust
        gains.append(off(reach, found.controls, truth) / off(reach, nothing.controls, truth))
        assert set(found.inferred) == set(truth)
        misses.append(found.targets[0].miss)
    # Who stands or sits, and how tall they are, no hand tells: the rest is found.
    assert np.median(gains) < 0.4
    assert np.median(misses) < 1e-3


def test_a_control_that_the_target_is_about_is_read_off_it(reach):
    _, place = captured(reach, 12)
    found = asked(reach, place)
    assert found.controls["target_height"] == place[1]
    other = asked(reach, place, joint="LeftHand")
    assert other.controls["target_height"] != place[1]


def test_the_chosen_controls_give_the_same_clip(reach):
    _, place = captured(reach, 30)
    hold = {"targets": (Target("RightHand", tuple(place), at="end"),)}
    partial = clips.synthesize_clip(reach, ClipQuestion(controls={}, **hold))
    whole = clips.synthesize_clip(reach, ClipQuestion(controls=partial.trust.controls, **hold))
    assert np.array_equal(partial.clip.rotations, whole.clip.rotations)
    assert whole.trust.inferred == ()


@pytest.mark.parametrize("height", [2.8, 50.0])
def test_a_target_beyond_reach_breaks_no_pose(reach, height):
    hold = {"targets": (Target("RightHand", (-0.2, height, 0.5), at="end"),)}
    far = clips.synthesize_clip(reach, ClipQuestion(controls={}, **hold))
    control = reach.session.card.control("target_height")
    assert far.trust.controls["target_height"] == control.maximum
    # As high as hips get that stand; the control itself would have lifted them off the floor.
    standing = reach.session.card.control("hip_height").maximum
    assert far.clip.root_path[:, 1].max() < standing + 0.05
    assert not far.trust.targets[0].reached and far.trust.targets[0].miss > 0.5
