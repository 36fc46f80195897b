"""Tests of answers with constraints, as clips and as poses."""

from dataclasses import replace

import numpy as np
import pytest

from posefield.constraints.targets import NO_CONSTRAINTS, ConstraintSet
from posefield.inference import session
from posefield.inference.session import Session
from posefield.motion.measures import Measure
from posefield.question.motion_question import ClipQuestion, PoseQuestion, Target
from posefield.synthesis import clips, poses
from posefield.synthesis.synthesizer import Synthesizer

FREE = {"exact": "none"}


def measured(path, measures) -> Synthesizer:
    opened: Session = session.load(path)
    controls = tuple(replace(c, measure=measures.get(c.name)) for c in opened.card.controls)
    card = replace(opened.card, controls=controls)
    return Synthesizer(path.stem, replace(opened, card=card))


@pytest.fixture(scope="module")
def reach(labelled_path) -> Synthesizer:
    """Return a reach model whose hand height can be constrained."""
    names = session.load(labelled_path).card.skeleton.names
    return measured(
        labelled_path, {"target_height": Measure("height", (names.index("RightHand"),), "end")}
    )


@pytest.fixture(scope="module")
def walk(walk_path) -> Synthesizer:
    """A model of a walk."""
    return Synthesizer("walk", session.load(walk_path))


def middle(model, **changed):
    return {c.name: c.default for c in model.session.card.controls} | changed


def joint(model, answer, name) -> np.ndarray:
    """Path (F, 3) of a joint of a clip."""
    return answer.clip.positions()[:, model.session.card.skeleton.names.index(name)]


def test_a_hand_ends_where_it_is_told_to(reach):
    controls = middle(reach)
    free = clips.synthesize_clip(reach, ClipQuestion(controls=controls, **FREE))
    goal = joint(reach, free, "RightHand")[-1] + [0.03, 0.02, -0.04]
    target = Target("RightHand", tuple(goal), free.trust.duration)
    hold = {"exact": FREE["exact"], "targets": (target,)}
    held = clips.synthesize_clip(
        reach, ClipQuestion(controls=controls, fps=10 / free.trust.duration, **hold)
    )
    assert np.linalg.norm(joint(reach, held, "RightHand")[-1] - goal) < 1e-4
    assert np.linalg.norm(joint(reach, free, "RightHand")[-1] - goal) > 0.05
    (met,) = held.trust.targets
    assert met.reached and met.miss < 1e-4 and met.unit == "m" and free.trust.targets == ()


def test_a_measured_control_is_met_unless_asked_otherwise(reach):
    controls = middle(reach)
    held, free = (
        clips.synthesize_clip(reach, ClipQuestion(controls=controls, **hold)) for hold in ({}, FREE)
    )
    off = free.trust.measured["target_height"] - controls["target_height"]
    assert abs(off) > 1e-3
    assert held.trust.measured["target_height"] == pytest.approx(
        controls["target_height"], abs=1e-4
    )
    assert [met.what for met in held.trust.targets] == ["target_height"]


def test_what_is_met_already_does_not_hinder_what_is_out_of_reach(reach):
    controls = middle(reach)
    free = poses.synthesize_poses(reach, PoseQuestion(controls=controls, times=[0.5], **FREE))
    stays = Target("Hips", tuple(map(float, free.root_position[0])), time=0.5)
    question = reach.validator.question(controls, "warn", None, 0)
    begun = reach.solver.solve(question, NO_CONSTRAINTS)
    hips = begun.scene.positions(begun.numbers, 0, np.array([0.0]))[0]
    exactly = Target("Hips", tuple(hips), at="start"), Target("LeftHand", (0.3, 2.5, 0.7), at="end")
    for targets in (exactly, (stays, exactly[1])):
        asked = ClipQuestion(controls=controls, exact="none", targets=targets)
        near, far = clips.synthesize_clip(reach, asked).trust.targets
        assert near.miss < 1e-3 < far.miss


def test_a_speed_is_met_by_way_and_duration(walk):
    question = walk.validator.question(middle(walk), "warn", None, 0)
    free = walk.solver.solve(question, NO_CONSTRAINTS)
    before = np.hypot(*free.travel[:2]) / free.duration
    goals = ConstraintSet((("haste", Measure("speed"), 1.003 * before),), ())
    held = walk.solver.solve(question, goals)
    assert np.hypot(*held.travel[:2]) / held.duration == pytest.approx(1.003 * before, rel=1e-5)
    assert held.results[0].reached and held.results[0].unit == "m/s"
    # Captured walkers who are faster take steps that are shorter in time.
    assert held.duration < free.duration
    assert np.array_equal(held.scene.motion(held.numbers), free.scene.motion(free.numbers))


def test_a_held_cycle_closes(walk):
    controls = middle(walk)
    plain = clips.synthesize_clip(walk, ClipQuestion(controls=controls))
    place = joint(walk, plain, "LeftFoot")[0] + [0.02, 0.02, 0.0]
    hold = {"exact": "none", "targets": (Target("LeftFoot", tuple(place), time=0.2),)}
    loop = clips.synthesize_clip(
        walk, ClipQuestion(controls=controls, root="in_place", loop=True, **hold)
    ).clip
    assert np.abs(loop.positions()[0] - loop.positions()[-1]).max() < 1e-9
    assert np.abs(loop.positions()[0] - loop.positions()[5]).max() > 1e-2
    free = clips.synthesize_clip(
        walk, ClipQuestion(controls=controls, root="in_place", loop=True, **FREE)
    ).clip
    assert np.abs(free.positions() - loop.positions()).max() > 1e-3


def test_the_same_question_gives_the_same_numbers(reach, labelled_path):
    hold = {"targets": (Target("LeftHand", (0.3, 1.2, 0.4), at="event"),)}
    names = session.load(labelled_path).card.skeleton.names
    other = measured(
        labelled_path, {"target_height": Measure("height", (names.index("RightHand"),), "end")}
    )
    both = [
        clips.synthesize_clip(m, ClipQuestion(controls=middle(m), **hold)).clip
        for m in (reach, other, reach)
    ]
    assert np.array_equal(both[0].rotations, both[1].rotations)
    assert np.array_equal(both[0].rotations, both[2].rotations)


def test_an_extreme_is_met_where_it_is(reach):
    controls = middle(reach)
    free = clips.synthesize_clip(reach, ClipQuestion(controls=controls, fps=200.0, **FREE))
    path = joint(reach, free, "LeftHand")
    top = path[np.argmax(path[:, 1])]
    target = Target("LeftHand", tuple(np.add(top, [0.0, 0.03, 0.0])), at="highest")
    held = clips.synthesize_clip(
        reach, ClipQuestion(controls=controls, fps=200.0, exact="none", targets=(target,))
    )
    assert joint(reach, held, "LeftHand")[:, 1].max() == pytest.approx(top[1] + 0.03, abs=2e-3)
    assert held.trust.targets[0].reached


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
