"""Stances of many feet at once: the same as those of each foot alone."""

from dataclasses import replace

import numpy as np
from few_feet import FootPath, discipline, foot_rows, frame_rows, runs_alone
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from posefield.feet import stance_rows
from posefield.feet.stance_rows import Cycle
from posefield.motion.contact_detection import FootContact

RATE, LENGTHS = 30.0, (60, 45, 70)
FRAMES = sum(LENGTHS)
FOOT = FootContact(0, 0.04, 0.3, 0.5, 0.05)
CYCLE = Cycle(0.7 + 0.1j, np.exp(0.2j))
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
    assert listed(found) == [runs_alone(own, cyclic) for own in each(down)]
    assert (found.mask(rows(cyclic)) == down).all()


@given(st.one_of(FLICKERS, CONTACTS), CYCLIC)
def test_no_stance_and_no_gap_within_a_motion_is_short(down, cyclic):
    found = stance_rows.tidy(down, rows(cyclic))
    gaps = stance_rows.runs(~found.mask(rows(cyclic)), rows(cyclic))
    for own, least in ((found, stance_rows.SHORTEST_CONTACT), (gaps, stance_rows.SHORTEST_GAP)):
        assert (own.lengths[own.inner(rows(cyclic))] >= least * RATE).all()
    before = stance_rows.runs(down, rows(cyclic))
    long = before.select(before.lengths >= stance_rows.shortest(rows(cyclic))[before.rows])
    assert found.mask(rows(cyclic))[long.mask(rows(cyclic))].all()


@given(CONTACTS, FLICKERS, st.integers(0, 99), CYCLIC)
def test_a_row_has_the_stances_that_it_has_alone(down, beyond, seed, cyclic):
    def planned(down, beyond, paths):
        own = foot_rows(paths, FOOT)
        found = stance_rows.discipline(stance_rows.tidy(down, own.rows), own)
        shorter = stance_rows.shortened(found, beyond, own.rows)
        assert (shorter.begins < own.rows.counts[shorter.rows]).all()
        return [[*found.by_row(len(paths))], [*shorter.by_row(len(paths))]]

    paths = feet(seed, cyclic)
    together = zip(*planned(down, beyond, paths), strict=True)
    for own, far, path, found in zip(each(down), each(beyond), paths, together, strict=True):
        assert planned(own, far, [path]) == [[runs] for runs in found]


def test_gaps_are_closed_first_and_of_a_stance_out_of_reach_the_longest_part_stays():
    down = np.ones(60, bool)
    down[[10, 11, 40, 41, 42, 43, 44, 45, 47, 48, 49, 50, 51, 52]] = False
    one = frame_rows([down], RATE, False)
    found = stance_rows.tidy(down, one)
    assert found.by_row(1) == [(range(40), range(53, 60))]
    beyond = np.isin(np.arange(60), (9, 33, 55, 57))
    assert stance_rows.shortened(found, beyond, one).by_row(1) == [(range(10, 33),)]


def test_a_swing_that_goes_nowhere_is_none_unless_the_foot_is_in_the_air():
    held = [range(40), range(60, 100)]
    assert discipline(held, path_of(np.zeros(100)), FOOT) == [range(100)]
    lifted = np.where((np.arange(100) >= 40) & (np.arange(100) < 60), 0.3, 0.04)
    assert discipline(held, path_of(np.zeros(100), lifted), FOOT) == held


FOOT_RATE = 60.0


def path_of(forward, height=0.04, cycle=None):
    """A foot that goes ahead as said, m, at a constant height."""
    places = np.zeros((len(forward), 3))
    places[:, 1], places[:, 2] = height, forward
    return FootPath(places, FOOT_RATE, cycle)


def test_a_long_swing_is_cut_where_the_foot_goes_most():
    forward = np.concatenate([np.zeros(40), np.linspace(0.0, 0.5, 20), np.full(40, 0.5)])
    held = [range(10), range(90, 100)]
    (before, after) = discipline(held, path_of(forward), FOOT)
    assert after.start - before.stop == round(FOOT.swing * FOOT_RATE)
    assert 38 <= before.stop <= 42


def test_a_long_swing_within_a_walk_stays():
    forward = np.concatenate([np.zeros(40), np.linspace(0.0, 0.5, 20), np.full(40, 0.5)])
    held = [range(10), range(90, 100)]
    walking = np.zeros(100, bool)
    walking[5:95] = True
    assert discipline(held, replace(path_of(forward), walking=walking), FOOT) == held
    walking[80:] = False
    assert discipline(held, replace(path_of(forward), walking=walking), FOOT) != held
