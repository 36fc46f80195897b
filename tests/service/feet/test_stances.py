"""Stances and swings: runs, tidying, and swings as captured feet have them."""

from dataclasses import replace

import numpy as np
import pytest
from few_feet import discipline
from hypothesis import given
from hypothesis import strategies as st

from posefield.feet import stances
from posefield.feet.stances import Cycle, FootPath, Interval
from posefield.motion.foot_contacts import FootContact

RATE = 60.0
FOOT = FootContact(0, 0.04, 0.3, 0.5, 0.05)


def path_of(forward, height=0.04, cycle=None):
    """A foot that goes ahead as said, m, at a constant height."""
    places = np.zeros((len(forward), 3))
    places[:, 1], places[:, 2] = height, forward
    return FootPath(places, RATE, cycle)


@given(st.lists(st.booleans(), min_size=1, max_size=40), st.booleans())
def test_runs_cover_their_frames_and_no_others(down, cyclic):
    down = np.array(down)
    found = stances.runs(down, cyclic)
    assert (stances.mask(found, len(down)) == down).all()
    assert all(0 <= run.begin < len(down) and len(run) > 0 for run in found)
    assert sum(map(len, found)) == down.sum()


def test_a_long_swing_is_cut_where_the_foot_goes_most():
    forward = np.concatenate([np.zeros(40), np.linspace(0.0, 0.5, 20), np.full(40, 0.5)])
    held = [Interval(0, 10), Interval(90, 100)]
    (before, after) = discipline(held, path_of(forward), FOOT)
    assert after.begin - before.end == round(FOOT.swing * RATE)
    assert 38 <= before.end <= 42


def test_a_long_swing_within_a_walk_stays():
    forward = np.concatenate([np.zeros(40), np.linspace(0.0, 0.5, 20), np.full(40, 0.5)])
    held = [Interval(0, 10), Interval(90, 100)]
    walking = np.zeros(100, bool)
    walking[5:95] = True
    assert discipline(held, replace(path_of(forward), walking=walking), FOOT) == held
    walking[80:] = False
    assert discipline(held, replace(path_of(forward), walking=walking), FOOT) != held


def test_places_go_on_over_the_end_of_a_cycle():
    cycle = Cycle(1.0 + 0.5j, 0.3)
    found = path_of(np.linspace(0.0, 1.0, 10), cycle=cycle).places([9, 10, 11])
    assert found[0] == pytest.approx(1.0)
    assert found[1] == pytest.approx(cycle.way)
    assert found[2] == pytest.approx(cycle.way + np.exp(0.3j) / 9.0)
