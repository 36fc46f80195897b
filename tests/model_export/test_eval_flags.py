"""Tests of the support flag on held-out clips, and of its report."""

import numpy as np
import pytest

from posefield.kriging import support
from posefield_train.evaluate import support_flags
from posefield_train.evaluate.folds import Fold

NAMES = ("left", "up")


@pytest.fixture
def controls(rng):
    return rng.random((60, 2)) * [1.0, 3.0]


@pytest.fixture
def parts():
    return [Fold((i, i + 1)) for i in range(0, 60, 2)]


def test_what_is_captured_evenly_is_seldom_flagged_and_what_is_beyond_always(controls, parts):
    flags = support_flags.measure_flags(controls, NAMES, parts)
    assert flags.alarms < 0.15
    assert flags.beyond == {"left": 1.0, "up": 1.0}


def test_a_fold_does_not_know_what_it_holds_out(controls, parts):
    alone = np.vstack([controls, [[5.0, 1.0]], [[5.0, 1.1]]])
    apart = support_flags.measure_flags(alone, NAMES, [*parts, Fold((60, 61))])
    # Both clips of the last fold are flagged, which lie far beyond all others.
    assert apart.alarms >= 2 / 62
    assert (support.fit_support(alone).beyond(alone[60:]) == 0.0).all()
