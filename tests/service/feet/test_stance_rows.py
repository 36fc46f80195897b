"""Stances of many feet at once: the same as those of each foot alone, by loops."""

from dataclasses import replace

import numpy as np
import one_foot
from few_feet import discipline, foot_rows, frame_rows
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from posefield.feet import stance_rows, stances
from posefield.feet.stances import Cycle, FootPath, Interval
from posefield.motion.contact_detection import FootContact

RATE, LENGTHS = 30.0, (60, 45, 70)
FRAMES = sum(LENGTHS)
FOOT = FootContact(0, 0.04, 0.3, 0.5, 0.05)
CYCLE = Cycle(0.7 + 0.1j, 0.2)
CONTACTS = arrays.arrays(bool, FRAMES // 5).map(lambda few: np.repeat(few, 5))
FLICKERS = arrays.arrays(bool, FRAMES)
CYCLIC = st.booleans()


def each(values):
    return np.split(values, np.cumsum(LENGTHS)[:-1])


def rows(cyclic):
    return frame_rows([np.empty(length) for length in LENGTHS], RATE, cyclic)


def feet(seed, cyclic):
    """Feet that go on, pause, and are lifted now and then."""
    stream = np.random.default_rng(seed)
    found = []
    for length in LENGTHS:
        places = np.zeros((length, 3))
        places[:, 2] = np.cumsum(stream.uniform(-0.005, 0.04, length))
        places[:, 1] = 0.04 + 0.1 * (stream.uniform(size=length) > 0.8)
        found.append(FootPath(places, RATE, CYCLE if cyclic else None))
    return found


def listed(runs):
    return [list(own) for own in runs.by_row(len(LENGTHS))]


@given(FLICKERS, CYCLIC)
def test_runs_are_those_of_each_row(down, cyclic):
    found = stance_rows.runs(down, rows(cyclic))
    assert listed(found) == [stances.runs(own, cyclic) for own in each(down)]
    assert (found.mask(rows(cyclic)) == down).all()


@given(st.one_of(FLICKERS, CONTACTS), CYCLIC)
def test_contacts_are_tidied_as_those_of_one_foot(down, cyclic):
    expected = [one_foot.tidy(own, RATE, cyclic) for own in each(down)]
    assert listed(stance_rows.tidy(down, rows(cyclic))) == expected


@given(CONTACTS, st.integers(0, 99), CYCLIC)
def test_swings_become_as_captured_ones_as_those_of_one_foot(down, seed, cyclic):
    paths = feet(seed, cyclic)
    found = stance_rows.discipline(stance_rows.tidy(down, rows(cyclic)), foot_rows(paths, FOOT))
    expected = [
        one_foot.discipline(one_foot.tidy(own, RATE, cyclic), path, FOOT)
        for own, path in zip(each(down), paths, strict=True)
    ]
    assert listed(found) == expected


@given(CONTACTS, FLICKERS, CYCLIC)
def test_of_a_stance_out_of_reach_the_longest_part_stays(down, beyond, cyclic):
    found = stance_rows.shortened(stance_rows.runs(down, rows(cyclic)), beyond, rows(cyclic))
    expected = [
        one_foot.shortened(stances.runs(own, cyclic), far, path)
        for own, far, path in zip(each(down), each(beyond), feet(0, cyclic), strict=True)
    ]
    assert listed(found) == expected


FOOT_RATE = 60.0


def path_of(forward, height=0.04, cycle=None):
    """A foot that goes ahead as said, m, at a constant height."""
    places = np.zeros((len(forward), 3))
    places[:, 1], places[:, 2] = height, forward
    return FootPath(places, FOOT_RATE, cycle)


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
    assert after.begin - before.end == round(FOOT.swing * FOOT_RATE)
    assert 38 <= before.end <= 42


def test_a_long_swing_within_a_walk_stays():
    forward = np.concatenate([np.zeros(40), np.linspace(0.0, 0.5, 20), np.full(40, 0.5)])
    held = [Interval(0, 10), Interval(90, 100)]
    walking = np.zeros(100, bool)
    walking[5:95] = True
    assert discipline(held, replace(path_of(forward), walking=walking), FOOT) == held
    walking[80:] = False
    assert discipline(held, replace(path_of(forward), walking=walking), FOOT) != held
