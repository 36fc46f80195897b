"""Tests of the report of constraints that a motion does not satisfy."""

import pytest

from posefield.common.errors import OutOfReach
from posefield.constraints.targets import ConstraintSet, JointTarget
from posefield.motion.measures import Measure
from posefield.question.results import ConstraintResult
from posefield.synthesis import synthesizer

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
