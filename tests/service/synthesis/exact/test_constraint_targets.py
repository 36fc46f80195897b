"""Tests of the constraints of questions: defaults and errors."""

import math
from dataclasses import replace

import pytest

from posefield.common.errors import InvalidField, OutOfReach
from posefield.constraints import targets as goals
from posefield.constraints.targets import ConstraintSet, JointTarget
from posefield.inference import session
from posefield.motion.measures import Measure
from posefield.question.motion_question import MotionQuestion, Target
from posefield.question.results import ConstraintResult
from posefield.synthesis import synthesizer
from posefield.validation.question_validation import QuestionValidator

PLACE = (0.3, 1.2, 0.4)


@pytest.fixture(scope="module")
def card(labelled_path):
    """A card two of whose controls are measured: one on the motion, one on the body."""
    own = session.load(labelled_path).card
    hand = own.skeleton.names.index("RightHand")
    measures = {"target_height": Measure("height", (hand,), "end"), "stature": Measure("stature")}
    controls = tuple(replace(c, measure=measures.get(c.name)) for c in own.controls)
    return replace(own, controls=controls)


def question(card, **changed):
    controls = {control.name: control.default for control in card.controls}
    return replace(QuestionValidator(card).question(controls, "warn", None, 0), **changed)


def found(card, *targets, exact="auto"):
    return goals.from_question(
        card, question(card), MotionQuestion(controls={}, exact=exact, targets=targets)
    )


def test_auto_holds_to_what_is_measured_on_the_motion(card):
    assert [name for name, _, _ in found(card).controls] == ["target_height"]
    assert found(card, exact="none") == goals.NO_CONSTRAINTS
    assert not found(card, exact="none")


@pytest.mark.parametrize(
    ("exact", "said"),
    [
        (("tallness",), "'tallness', expected controls of this model: stature"),
        (("stature",), "'stature' is not measured on a motion, expected some of: target_height"),
    ],
)
def test_a_control_that_cannot_be_exact_is_named(card, exact, said):
    with pytest.raises(InvalidField, match=said) as fault:
        found(card, exact=exact)
    assert fault.value.field == "exact"


@pytest.mark.parametrize(
    ("target", "field", "said"),
    [
        (Target("Tail", PLACE, at="end"), "targets/0/joint", "'Tail', expected one of Hips"),
        (
            Target("LeftHand", (0.0, math.nan, 1.0), at="end"),
            "targets/0/position/1",
            "nan, expected",
        ),
        (Target("LeftHand", (0.0, 1.0, 1e4), at="end"), "targets/0/position/2", "-100 to 100 m"),
        (
            Target("LeftHand", (0.0, 1.0), at="end"),
            "targets/0/position",
            "2 numbers, expected three",
        ),
        (Target("LeftHand", PLACE, time=1e9), "targets/0/time", "1e.09 s, expected 0 to"),
    ],
)
def test_a_target_that_is_none_is_named(card, target, field, said):
    with pytest.raises(InvalidField, match=said) as fault:
        found(card, target)
    assert fault.value.field == field


@pytest.mark.parametrize("when", ["end", 0.5])
def test_a_joint_has_one_target_at_a_moment(card, when):
    twins = Target("LeftHand", PLACE, when), Target("LeftHand", (0.0, 1.0, 0.0), when)
    with pytest.raises(InvalidField, match="has a target already") as fault:
        found(card, *twins)
    assert fault.value.field == "targets/1"
    assert len(found(card, twins[0], Target("RightHand", PLACE, when)).targets) == 2


def test_more_targets_than_anybody_has_joints_for_are_refused(card):
    many = [Target("LeftHand", PLACE, 0.01 * i) for i in range(goals.MAX_TARGETS + 1)]
    with pytest.raises(InvalidField, match="more than 32"):
        found(card, *many)
    assert len(found(card, *many[:-1]).targets) == goals.MAX_TARGETS


def test_a_target_counts_before_the_control_of_the_same_joint(card):
    held = found(card, Target("RightHand", PLACE, at="end"))
    assert held.controls == () and len(held.targets) == 1
    assert len(found(card, Target("RightHand", PLACE, at="start")).controls) == 1
    with pytest.raises(InvalidField, match="for whose joint there is a target"):
        found(card, Target("RightHand", PLACE, at="end"), exact=("target_height",))


HIGH = Measure("height", (3,), "highest")


GOALS = ConstraintSet(
    (("speed", Measure("speed"), 2.0),), (JointTarget("hand at 1 s", HIGH, (0, 0, 0), 1.0),)
)


SLOW = ConstraintResult("speed", 0.1234, "m/s", False)


SHORT = ConstraintResult("hand at 1 s", 0.1234, "m", False)


FINE = ConstraintResult("hand at 1 s", 1e-6, "m", True)


def test_each_miss_is_a_sentence():
    assert synthesizer.miss_warnings([SLOW, SHORT]) == (
        "speed stays 0.123 m/s from its target: out of reach",
        "hand at 1 s stays 12.3 cm from its target: out of reach",
    )
    assert synthesizer.miss_warnings([FINE]) == ()


@pytest.mark.parametrize(
    ("met", "field"),
    [
        ([SLOW, SHORT], "controls/speed"),
        ([SLOW, FINE], "controls/speed"),
        ([ConstraintResult("speed", 0.0, "m/s", True), SHORT], "targets/0"),
    ],
)
def test_the_first_miss_is_named(met, field):
    with pytest.raises(OutOfReach) as caught:
        synthesizer.check_targets(GOALS, met)
    assert caught.value.field == field
    assert caught.value.message == "; ".join(synthesizer.miss_warnings(met))
