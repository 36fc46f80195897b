"""Tests of the support flag on held-out clips, and of its report."""

from dataclasses import replace

import numpy as np
import pytest

from posefield.common.errors import InvalidField
from posefield.kriging import support
from posefield_train.evaluate import support_flags
from posefield_train.evaluate.folds import Fold
from posefield_train.evaluate.support_flags import SupportFlags

NAMES = ("left", "up")
RAISED = np.array([0.0, 30.0, 0.0, 0.0])


@pytest.fixture
def controls(rng):
    return rng.random((60, 2)) * [1.0, 3.0]


@pytest.fixture
def parts():
    return [Fold((i, i + 1)) for i in range(0, 60, 2)]


def test_what_is_captured_evenly_is_seldom_flagged_and_what_is_beyond_always(controls, parts):
    found = support_flags.measure_flags(controls, NAMES, parts)
    assert found.alarms < 0.15
    assert found.beyond == {"left": 1.0, "up": 1.0}


def test_a_fold_does_not_know_what_it_holds_out(controls, parts):
    alone = np.vstack([controls, [[5.0, 1.0]], [[5.0, 1.1]]])
    apart = support_flags.measure_flags(alone, NAMES, [*parts, Fold((60, 61))])
    # Both strangers of the last fold are flagged, who stand far beyond what all others know.
    assert apart.alarms >= 2 / 62
    assert (support.fit_support(alone).beyond(alone[60:]) == 0.0).all()


def test_two_families_are_joined_by_what_both_have_and_their_gap_is_flagged(small_recipe, examples):
    up = [replace(e, controls=e.controls + RAISED) for e in examples]
    found = support_flags.measure_joined(small_recipe, examples, small_recipe, up)
    assert found.gap is not None
    control, share = found.gap
    assert (control, share) == ("hip_height", 1.0)
    assert set(found.beyond) == {"stature", "hip_height", "turn", "target_height"}
    assert found.alarms < 0.2


def test_families_without_a_gap_cannot_be_joined(small_recipe, examples):
    with pytest.raises(InvalidField, match="overlap in stature, hip_height"):
        support_flags.measure_joined(small_recipe, examples[::2], small_recipe, examples[1::2])


def test_it_is_said_in_a_sentence_and_in_figures():
    found = SupportFlags(0.1034, {"left": 1.0, "up": 0.75}, ("up", 0.5))
    text = found.text()
    assert "10.3 % of held-out clips are flagged" in text
    assert text.endswith("left 100 %, up 75 %; of clips moved into the gap of up: 50 %")
    assert found.facts() == {
        "false_alarms": 0.1034,
        "beyond": {"left": 1.0, "up": 0.75},
        "gap": {"control": "up", "flagged": 0.5},
    }
    assert "gap" not in replace(found, gap=None).facts()
