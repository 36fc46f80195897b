"""Targets of acts in performances: before the next join and hold, at moments, and in the report."""

from dataclasses import replace

import acting
import changed_cards
import msgspec
import numpy as np
import pytest

from posefield.common.errors import InvalidField
from posefield.model_file.model_card import Event
from posefield.motion.measures import Measure
from posefield.performance import act_motion, composition
from posefield.performance.script import resolve_script
from posefield.question import json_decoding
from posefield.question.motion_question import MotionQuestion
from posefield.question.performance_question import PerformanceQuestion
from posefield.registry import model_registry

EXACT, STILL = 1e-3, 1e-5
HAND = "RightHand"


@pytest.fixture(scope="module")
def find(models):
    """The models of the examples; a reach without event, one whose event is early, and a walk."""
    library = dict(model_registry.load([models]).models)
    reach = library["reach"]
    own = reach.session.card.event
    library["free"] = changed_cards.with_card(reach, event=None)
    library["early"] = changed_cards.with_card(reach, event=Event(own.joint, 0.5))
    library["standing"] = measured_at_start(reach)
    library["cmu_walk"] = model_registry.load([model_registry.SHIPPED_FOLDER]).find("cmu_walk")
    return library.__getitem__


def measured_at_start(model):
    """The model with the height of its hips measured in the first pose."""
    control = model.session.card.control("hip_height")
    measured = replace(control, measure=Measure("height", (0,), "start"))
    controls = [measured if own is control else own for own in model.session.card.controls]
    return changed_cards.with_card(model, controls=tuple(controls))


@pytest.fixture(scope="module")
def own_hand(find):
    """The hand's path (F, 3), m, of the reach of no controls, at 60 frames a second."""
    return acting.joint_path(find("reach"), act_motion.act_passage(find("reach"), ASKED), HAND)


ASKED = MotionQuestion(controls={})


def performed(find, *segments, fps=60):
    content = msgspec.json.encode({"segments": segments, "fps": fps})
    question = json_decoding.decode_question(PerformanceQuestion, content)
    return composition.perform(resolve_script(question, find), 10_000)


def reach(position, model="free", **when):
    place = [float(axis) for axis in position]
    return {"kind": "act", "model": model, "targets": [{"joint": HAND, "position": place, **when}]}


def path(answer, name=HAND):
    clip = answer.clip
    return clip.positions()[:, clip.skeleton.names.index(name)]


PLAIN = {"kind": "act", "model": "free"}


def test_an_act_is_left_after_its_last_target(find, own_hand):
    seconds = 1.35
    wanted = own_hand[round(60 * seconds)] + [0.02, 0.03, 0.0]
    answer = performed(find, reach(wanted, time=seconds), PLAIN)
    first, second = answer.trust.segments
    assert second.begins >= seconds - 0.02
    assert np.linalg.norm(path(answer)[round(60 * seconds)] - wanted) < EXACT
    assert first.targets[0].reached
    assert answer.trust.script_warnings == ()
    # An act without a target is left earlier.
    assert performed(find, PLAIN, PLAIN).trust.segments[1].begins < seconds - 0.1


@pytest.mark.parametrize("when", ["highest", "lowest", "farthest"])
def test_a_target_at_a_moment_of_the_motion_is_met_by_the_character(find, own_hand, when):
    frame = {"highest": 86, "lowest": 0, "farthest": 86}[when]
    wanted = own_hand[frame] + [0.02, 0.03, 0.02]
    for fps in (24.0, 30.0, 60.0):
        answer = performed(find, reach(wanted, at=when), PLAIN, fps=fps)
        (target,) = answer.trust.segments[0].targets
        assert target.reached and (answer.trust.stretch or 0.0) <= 0.5 / fps + 1e-6
        assert np.linalg.norm(path(answer) - wanted, axis=-1).min() < EXACT


def test_the_event_at_the_end_of_a_performance_is_its_last_frame(find, own_hand):
    wanted = own_hand[-1] + [0.02, 0.03, 0.02]
    for fps in (24.0, 30.0):
        answer = performed(find, reach(wanted, "reach", at="event"), fps=fps)
        assert np.linalg.norm(path(answer)[-1] - wanted) < EXACT
        assert answer.trust.duration == pytest.approx((len(path(answer)) - 1) / fps, abs=1e-6)
        # The event is told in the time of the motion, whose nearest frame it has.
        assert round(fps * answer.trust.segments[0].event) == len(path(answer)) - 1
    # Without an event there are frames at equal times until the end at most.
    plain = performed(find, PLAIN, fps=24.0)
    assert plain.trust.stretch is None and plain.trust.duration > (len(path(plain)) - 1) / 24.0


def test_a_hold_that_would_cut_off_a_target_is_refused(find, own_hand):
    asked = reach(own_hand[-5], "early", time=(len(own_hand) - 5) / 60.0)
    with pytest.raises(
        InvalidField, match=r"before the moment of the target /segments/0/targets/0"
    ):
        performed(find, asked, {"kind": "hold", "seconds": 0.5})
    assert performed(find, asked, PLAIN).trust.segments[0].targets[0].reached


def test_the_report_tells_how_far_the_character_stays_from_a_target(find):
    answer = performed(find, reach([0.0, 9.0, 0.0], "reach", at="event"))
    (segment,) = answer.trust.segments
    missed = np.linalg.norm(path(answer)[round(60 * segment.event)] - [0.0, 9.0, 0.0])
    assert not segment.targets[0].reached
    assert segment.targets[0].miss == pytest.approx(missed, abs=1e-4)
    (warning,) = [own for own in answer.trust.script_warnings if "target" in own.message]
    assert warning.pointer == "/segments/0/targets/0"
    assert warning.message == f"stays {100.0 * missed:.1f} cm from its target: out of reach"


@pytest.mark.parametrize("height", [0.8, 1.0])
def test_controls_of_the_first_pose_are_those_of_the_pose_that_an_act_goes_on_from(find, height):
    first = {"kind": "act", "model": "standing", "controls": {"hip_height": height}}
    then, hold = {"kind": "act", "model": "standing"}, {"kind": "hold", "seconds": 0.2}
    answer = performed(find, first, hold, then)
    begins, controls = answer.trust.segments[2].begins, answer.trust.segments[2].controls
    met = answer.clip.root_path[round(60 * begins), 1]
    assert controls["hip_height"] == pytest.approx(met, abs=0.01)
    # A control that the script gives stays; one that is not measured there is typical.
    given = performed(find, first, hold, {**then, "controls": {"hip_height": 0.6}}).trust
    assert given.segments[2].controls["hip_height"] == 0.6
    first, then = ({**act, "model": "reach"} for act in (first, then))
    typical = performed(find, first, hold, then).trust.segments[2].controls["hip_height"]
    assert abs(typical - met) > 0.1


@pytest.mark.parametrize("joint", ["LeftHand", "RightHand"])
def test_a_held_hand_is_still_while_the_feet_are_placed(find, joint):
    walk = {"kind": "walk", "model": "cmu_walk", "seconds": 2.0}
    segments = walk, {"kind": "hold", "seconds": 1.0, "joint": joint}, walk
    answer = performed(find, *segments)
    hold = answer.trust.segments[1]
    rows = slice(round(60 * hold.begins), round(60 * hold.ends) + 1)
    assert np.ptp(path(answer, joint)[rows], axis=0).max() < STILL
    assert answer.trust.feet.skate < 0.5 * answer.trust.feet.skate_before
    free = performed(find, walk, {"kind": "hold", "seconds": 1.0}, walk)
    assert np.ptp(path(free, joint)[rows], axis=0).max() > 100.0 * STILL
