"""Tests of acts: frames through the event, poses, contacts, and bad input."""

import acting
import changed_cards
import numpy as np
import pytest

from posefield.common.errors import InvalidField, OutOfReach
from posefield.feet import stance_rows
from posefield.inference import session
from posefield.inference.onnx_runtime import CONTACTS
from posefield.locomotion import floor_plane
from posefield.model_file.model_card import Event
from posefield.performance import act_motion, acts
from posefield.performance.passage import RATE
from posefield.question.motion_question import ClipQuestion, MotionQuestion, PoseQuestion, Target
from posefield.synthesis import clips, poses
from posefield.synthesis.synthesizer import Synthesizer

HIGH = {"target_height": 1.6}


@pytest.fixture(scope="module")
def reach(model_path):
    return changed_cards.measured_reach(Synthesizer("reach", session.load(model_path)))


@pytest.fixture(scope="module")
def walker(walk_path):
    return Synthesizer("stroll", session.load(walk_path))


def test_times_pass_through_the_moment_at_the_rate():
    for moment, duration in ((0.0, 1.01), (1.01, 1.01), (0.333, 1.01), (0.5, 0.52)):
        times, frame = act_motion.times_through(moment, duration)
        assert times[frame] == moment
        assert np.allclose(np.diff(times), 1.0 / RATE, atol=1e-12)
        assert 0.0 <= times[0] < 1.0 / RATE
        assert duration - 1.0 / RATE < times[-1] <= duration
    with pytest.raises(InvalidField, match=r"a motion of 0\.01 s, expected at least two frames"):
        act_motion.times_through(0.01, 0.01)


def test_an_act_has_the_poses_of_the_model_at_its_times(reach):
    asked = MotionQuestion(controls=HIGH)
    found = act_motion.act_passage(reach, asked)
    times = found.begins + np.arange(len(found.passage)) / RATE
    own = poses.synthesize_poses(reach, PoseQuestion(controls=HIGH, times=times.tolist()))
    assert np.allclose(found.passage.rotations, own.rotations, atol=1e-6)
    assert np.allclose(found.passage.roots, own.root_position, atol=1e-6)
    assert np.all(found.passage.sigmas == own.trust.sigma)
    assert found.trust.duration == own.trust.duration
    assert found.passage.phases is None
    # Frames that are not those of the event are other poses.
    plain = clips.synthesize_clip(reach, ClipQuestion(controls=HIGH, fps=RATE, feet="as_predicted"))
    assert not np.allclose(found.passage.roots[0], plain.clip.root_path[0], atol=1e-6)


def test_the_event_is_a_frame_whose_hand_meets_its_target(reach):
    place = (-0.1, 1.5, 0.5)
    found = act_motion.act_passage(reach, hand_to(place))
    assert found.event == len(found.passage) - 1
    hand = acting.joint_path(reach, found, "RightHand")
    assert np.linalg.norm(hand[found.event] - place) < 1e-3
    assert np.linalg.norm(hand[found.event - 12] - place) > 1e-2
    assert [met.what for met in found.trust.targets] == ["RightHand at event"]


def test_an_event_within_the_motion_is_a_frame_of_its_canonical_time(reach):
    early = changed_cards.with_card(reach, event=Event(reach.session.card.event.joint, 0.5))
    found = act_motion.act_passage(early, MotionQuestion(controls=HIGH))
    question = early.question(MotionQuestion(controls=HIGH))
    time = np.array([found.begins + found.event / RATE])
    frame = early.session.state(question.point, time, question.labels).frames[0]
    assert frame == pytest.approx(0.5 * (early.session.card.frames - 1), abs=1e-2)
    assert found.event < len(found.passage) - 1


def test_contacts_are_detected_where_the_model_has_none(reach):
    found = act_motion.act_passage(reach, MotionQuestion(controls=HIGH))
    toes = acting.joint_path(reach, found, "RightToeBase")
    assert found.passage.contacts.shape == (len(found.passage), 2)
    detected = stance_rows.detect(toes, RATE)
    assert np.array_equal(found.passage.contacts[:, 1], detected)


def test_contacts_are_those_of_the_model_in_the_order_of_its_feet(walker):
    card = walker.session.card
    still = changed_cards.with_card(walker, cyclic=False, feet=card.feet[::-1])
    asked = MotionQuestion(controls={own.name: own.default for own in card.controls})
    found = act_motion.act_passage(still, asked)
    times = found.begins + np.arange(len(found.passage)) / RATE
    question = still.question(asked)
    (likely,) = still.session.run(question.point, times[None], CONTACTS, labels=question.labels)
    assert np.allclose(found.passage.contacts, likely[0][:, ::-1], atol=1e-6)
    assert not np.allclose(found.passage.contacts, likely[0], atol=1e-2)


def test_a_cyclic_model_is_refused(walker):
    with pytest.raises(InvalidField, match=r"act: stroll is a cycle, expected a model of another"):
        act_motion.act_passage(walker, MotionQuestion(controls={}))


EXACT = 1e-3
"""Distance, m, within which targets are met."""


def hand_to(place):
    """Return a question with a target for the right hand at the event. place: m."""
    return MotionQuestion(controls={}, targets=(Target("RightHand", place, at="event"),))


def hand(reach, act, by):
    """Return the position of the right hand in the world at the event, m."""
    return acting.joint_path(reach, act, "RightHand", by)[act.event]


@pytest.mark.parametrize("facing", [0.0, 2.5])
def test_an_act_begins_at_its_place_and_meets_its_world_target(reach, facing):
    position = 1.0 + 2.0j
    near = act_motion.act_passage(reach, MotionQuestion(controls={})).motion_to(position, facing)
    wanted = near.place(np.array([-0.1, 1.5, 0.5]))
    asked = hand_to(tuple(wanted))
    act, by = acts.act_from(reach, asked, position, facing, [0])
    first = act.passage.placed(by).part(0, 1)
    assert abs(floor_plane.project(first.roots)[0] - position) < 1e-4
    assert first.heading() == pytest.approx(facing, abs=1e-4)
    assert np.linalg.norm(hand(reach, act, by) - wanted) < EXACT
    # One round is not enough: the target moves the first pose.
    once = acts.act_at(reach, asked, near, [0]).passage.placed(near)
    assert abs(floor_plane.project(once.roots)[0] - position) > 1e-4


def test_targets_that_move_the_first_pose_on_and_on_are_refused(reach):
    near = act_motion.act_passage(reach, MotionQuestion(controls={})).motion_to(0j, 0.0)
    asked = hand_to(tuple(near.place(np.array([-0.1, 1.5, 0.5]))))
    assert acts.act_from(reach, asked, 0j, 0.0, [0])[0].trust.targets[0].reached
    with pytest.raises(InvalidField, match=r"^at: the targets move the first pose 0\.\d+ m from"):
        acts.act_from(reach, asked, 0j, 0.0, [0], rounds=1)


def test_a_free_act_takes_place_where_its_target_is(reach):
    for facing in (-2.0, 0.0, 1.0):
        act, point = acts.place_by_target(reach, hand_to((2.0, 1.5, -3.0)))
        by = act.motion_to(-3.0 + 2.0j, facing, point)
        assert np.linalg.norm(hand(reach, act, by) - (2.0, 1.5, -3.0)) < EXACT
        first = act.passage.placed(by)
        assert first.heading() == pytest.approx(facing)


def test_a_height_out_of_reach_is_refused_with_the_captured_heights(reach):
    text = r"^targets/0: .* out of reach; captured clips have heights of 0\.\d\d to 1\.\d\d m"
    with pytest.raises(OutOfReach, match=text):
        acts.place_by_target(reach, hand_to((2.0, 3.5, -3.0)))
