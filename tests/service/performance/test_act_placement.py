"""Tests of places of acts: targets in the world, and acts that take place where a target is."""

import acting
import numpy as np
import pytest

from posefield.common.errors import InvalidField, OutOfReach
from posefield.inference import session
from posefield.locomotion import floor_plane
from posefield.performance.acts import act_placement, act_segment
from posefield.performance.passages.passage import FloorMotion
from posefield.question.motion_question import MotionQuestion, Target
from posefield.synthesis.synthesizer import Synthesizer

EXACT = 1e-3
"""Distance, m, within which targets are met."""


@pytest.fixture(scope="module")
def reach(model_path):
    return acting.measured_reach(Synthesizer("reach", session.load(model_path)))


def hand_to(place, **more):
    """Return a question with a target for the right hand at the event. place: m."""
    return MotionQuestion(controls={}, targets=(Target("RightHand", place, at="event"),), **more)


def hand(reach, placed):
    """Return the position of the right hand in the world at the event, m."""
    return acting.joint_path(reach, placed.act, "RightHand", placed.by)[placed.act.event]


def test_a_world_target_is_met_where_the_segment_is_placed(reach):
    by = FloorMotion(0.9, 3.0 - 2.0j)
    wanted = by.place(np.array([-0.1, 1.5, 0.5]))
    act = act_placement.act_at(reach, hand_to(tuple(wanted)), by, [0])
    placed = act_placement.PlacedAct(act, by)
    assert np.linalg.norm(hand(reach, placed) - wanted) < EXACT
    # In the frame of the segment the same numbers are another place.
    local = act_placement.act_at(reach, hand_to(tuple(wanted), extrapolate="ok"), by)
    assert np.linalg.norm(hand(reach, act_placement.PlacedAct(local, by)) - wanted) > 10.0 * EXACT


@pytest.mark.parametrize("facing", [0.0, 2.5])
def test_an_act_begins_at_its_place_and_meets_its_world_target(reach, facing):
    position = 1.0 + 2.0j
    near = act_segment.act_passage(reach, MotionQuestion(controls={})).motion_to(position, facing)
    wanted = near.place(np.array([-0.1, 1.5, 0.5]))
    asked = hand_to(tuple(wanted))
    found = act_placement.act_from(reach, asked, position, facing, [0])
    first = found.act.passage.placed(found.by).part(0, 1)
    assert abs(floor_plane.project(first.roots)[0] - position) < 1e-4
    assert first.heading() == pytest.approx(facing, abs=1e-4)
    assert np.linalg.norm(hand(reach, found) - wanted) < EXACT
    # One round is not enough: the target moves the first pose.
    once = act_placement.act_at(reach, asked, near, [0]).passage.placed(near)
    assert abs(floor_plane.project(once.roots)[0] - position) > 1e-4


def test_targets_that_move_the_first_pose_on_and_on_are_refused(reach):
    near = act_segment.act_passage(reach, MotionQuestion(controls={})).motion_to(0j, 0.0)
    asked = hand_to(tuple(near.place(np.array([-0.1, 1.5, 0.5]))))
    assert act_placement.act_from(reach, asked, 0j, 0.0, [0]).act.trust.targets[0].reached
    with pytest.raises(InvalidField, match=r"^at: the targets move the first pose 0\.\d+ m from"):
        act_placement.act_from(reach, asked, 0j, 0.0, [0], rounds=1)


def test_a_free_act_takes_place_where_its_target_is(reach):
    for facing in (-2.0, 0.0, 1.0):
        found = act_placement.place_by_target(reach, hand_to((2.0, 1.5, -3.0))).facing(facing)
        assert np.linalg.norm(hand(reach, found) - (2.0, 1.5, -3.0)) < EXACT
        first = found.act.passage.placed(found.by)
        assert first.heading() == pytest.approx(facing)


def test_a_target_in_the_segment_is_met_beside_the_one_that_places(reach):
    left = act_segment.act_passage(reach, MotionQuestion(controls={"target_height": 1.5}))
    wanted = acting.joint_path(reach, left, "LeftHand")[-1] + (0.0, 0.02, 0.0)
    asked = MotionQuestion(
        controls={},
        targets=(
            Target("LeftHand", tuple(wanted), at="event"),
            Target("RightHand", (2.0, 1.5, -3.0), at="event"),
        ),
    )
    targeted = act_placement.place_by_target(reach, asked, 1)
    found = targeted.facing(0.5)
    assert np.linalg.norm(hand(reach, found) - (2.0, 1.5, -3.0)) < EXACT
    own = acting.joint_path(reach, found.act, "LeftHand")[found.act.event]
    assert np.linalg.norm(own - wanted) < EXACT


@pytest.mark.parametrize("extrapolate", ["warn", "refuse"])
def test_a_height_out_of_reach_is_refused_with_the_captured_heights(reach, extrapolate):
    asked = hand_to((2.0, 3.5, -3.0), extrapolate=extrapolate)
    text = r"^targets/0: .* out of reach; captured clips have heights of 0\.\d\d to 1\.\d\d m"
    with pytest.raises(OutOfReach, match=text):
        act_placement.place_by_target(reach, asked)


@pytest.mark.parametrize(
    ("place", "text"),
    [
        ((1.0, 2.0), r"^targets/0/position: 2 numbers, expected three"),
        ((1.0, float("nan"), 0.0), r"^targets/0/position/1: nan"),
    ],
)
def test_positions_that_are_none_are_refused(reach, place, text):
    with pytest.raises(InvalidField, match=text):
        act_placement.place_by_target(reach, hand_to(place))
    with pytest.raises(InvalidField, match=text):
        act_placement.act_at(reach, hand_to(place), FloorMotion(), [0])
