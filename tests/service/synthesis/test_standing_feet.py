"""Tests of clips whose feet stand: anchors, exact targets, loops, and the facts in `trust`."""

from dataclasses import replace

import numpy as np
import pytest
from msgspec import structs

from posefield.common.errors import InvalidField
from posefield.common.units import UP
from posefield.inference import session
from posefield.motion.measures import Measure
from posefield.question.motion_question import ClipQuestion, Target
from posefield.synthesis import clips
from posefield.synthesis.synthesizer import Synthesizer


def with_card(model, **changed):
    card = replace(model.session.card, **changed)
    return Synthesizer(model.name, replace(model.session, card=card))


@pytest.fixture(scope="module")
def walker(walk_path):
    return Synthesizer("stroll", session.load(walk_path))


@pytest.fixture(scope="module")
def reach(labelled_path):
    """A reach model with feet, without contacts, whose hand height can be constrained."""
    model = Synthesizer("reach", session.load(labelled_path))
    names = model.session.card.skeleton.names
    controls = tuple(
        replace(control, measure=Measure("height", (names.index("RightHand"),), "end"))
        if control.name == "target_height"
        else control
        for control in model.session.card.controls
    )
    feet = (names.index("LeftFoot"), names.index("RightFoot"))
    return with_card(model, controls=controls, feet=feet, contacts=())


def middle(model):
    return {control.name: control.default for control in model.session.card.controls}


def made(model, **asked):
    return clips.synthesize_clip(model, ClipQuestion(controls=middle(model), **asked))


def joint(model, answer, name):
    return answer.clip.positions()[:, model.session.card.skeleton.names.index(name)]


def test_a_standing_foot_keeps_its_place_at_any_rate(walker):
    for fps in (30.0, 47.0, 240.0):
        answer = made(walker, fps=fps, feet="stand")
        told = answer.trust.feet
        assert len(told.stances) >= 2 and told.left == ()
        times = np.arange(len(answer.clip)) / fps
        for stance in told.stances:
            inside = (times >= stance.begin + 1e-6) & (times <= stance.end - 1e-6)
            path = joint(walker, answer, stance.joint)[inside]
            assert np.abs(path - stance.position).max(initial=0.0) < 2e-6
        assert told.drift < 1e-9 and told.skate < 0.5 * told.skate_before


def test_bones_keep_their_lengths_and_other_joints_their_rotations(walker):
    free, placed = made(walker, feet="as_predicted"), made(walker, feet="stand")
    names = walker.session.card.skeleton.names
    assert (placed.clip.translations[:, 1:] == free.clip.translations[:, 1:]).all()
    assert (placed.clip.rotations[:, 0] == free.clip.rotations[:, 0]).all()
    level = np.abs(placed.clip.root_path - free.clip.root_path) @ (1.0 - UP)
    assert level.max() < 1e-12
    turned = np.abs(placed.clip.rotations - free.clip.rotations).max(axis=(0, 2))
    assert {names[j] for j in np.flatnonzero(turned)} <= {
        side + part for side in ("Left", "Right") for part in ("UpLeg", "Leg", "Foot")
    }


def test_feet_as_predicted_have_the_bytes_of_a_model_without_contacts(walker):
    plain = with_card(walker, contacts=())
    ours, theirs = made(walker, feet="as_predicted"), made(plain)
    assert ours.clip.rotations.tobytes() == theirs.clip.rotations.tobytes()
    assert ours.clip.root_path.tobytes() == theirs.clip.root_path.tobytes()
    assert ours.trust == theirs.trust and ours.trust.feet is None


@pytest.mark.parametrize("root", ["travelling", "in_place"])
def test_a_loop_closes(walker, root):
    answer = made(walker, feet="stand", loop=True, root=root, fps=60.0)
    rotations, heights = answer.clip.rotations, answer.clip.root_path @ UP
    assert np.array_equal(rotations[-1, 1:], rotations[0, 1:])
    assert heights[-1] == heights[0]
    # It goes on over its seam as elsewhere.
    steps = np.abs(np.diff(np.concatenate([rotations, rotations[1:3]])[:, 1:], n=2, axis=0))
    seam = len(rotations) - 2
    assert steps[seam].max() < 1.5 * np.delete(steps, seam, axis=0).max()


def test_exact_targets_and_controls_stay_met(reach):
    free = made(reach, exact="none")
    # The last frame is the end.
    fps = 20.0 / free.trust.duration
    free = made(reach, exact="none", fps=fps)
    goal = np.add(joint(reach, free, "RightHand")[-1], [0.02, -0.01, 0.02])
    target = Target("RightHand", tuple(goal), at="end")
    placed = made(reach, exact="none", targets=(target,), fps=fps, feet="stand")
    assert np.abs(joint(reach, placed, "RightHand")[-1] - goal).max() < 1e-4
    assert placed.trust.targets[0].reached and placed.trust.feet.stances
    held = made(reach, fps=fps, feet="stand")
    wanted = middle(reach)["target_height"]
    assert joint(reach, held, "RightHand")[-1, 1] == pytest.approx(wanted, abs=1e-3)
    assert held.trust.measured["target_height"] == pytest.approx(wanted, abs=1e-3)


def test_a_foot_with_a_target_is_as_predicted_and_told(reach):
    fps = 20.0 / made(reach, exact="none").trust.duration
    free = made(reach, exact="none", fps=fps)
    goal = np.add(joint(reach, free, "LeftFoot")[-1], [0.05, 0.0, 0.05])
    asked = {"exact": "none", "targets": (Target("LeftFoot", tuple(goal), at="end"),), "fps": fps}
    placed, plain = made(reach, feet="stand", **asked), made(reach, **asked)
    assert np.abs(joint(reach, placed, "LeftFoot") - joint(reach, plain, "LeftFoot")).max() < 1e-6
    assert placed.trust.targets == plain.trust.targets
    assert placed.trust.feet.left == ("LeftFoot is as predicted: its leg meets an exact target",)
    assert {stance.joint for stance in placed.trust.feet.stances} == {"RightFoot"}


def test_feet_that_cannot_stand_are_refused(reach, walker):
    for model, said in (
        (with_card(reach, feet=()), "names no feet"),
        (with_card(walker, root="in_place"), "stays in place"),
    ):
        question = ClipQuestion(controls=middle(model), feet="stand")
        for ask in (clips.synthesize_clip, clips.check, clips.preview_clip):
            with pytest.raises(InvalidField, match=said) as fault:
                ask(model, question)
            assert fault.value.field == "feet"
        usual = clips.synthesize_clip(model, structs.replace(question, feet=None))
        assert usual.trust.feet is None
