"""Stances of many feet at once: the same as those of each foot alone."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from posefield.common.units import UP
from posefield.feet import stance_rows, stances
from posefield.feet.stances import FootPath
from posefield.motion.foot_contacts import FootContact

RATE, ROWS, FRAMES = 30.0, 3, 60
FOOT = FootContact(0, 0.04, 0.3, 0.5, 0.05)
CONTACTS = arrays.arrays(bool, (ROWS, 12)).map(lambda few: np.repeat(few, 5, axis=1))
FLICKERS = arrays.arrays(bool, (ROWS, FRAMES))


def feet(seed):
    """Feet that go on, pause, and are lifted now and then."""
    stream = np.random.default_rng(seed)
    places = np.zeros((ROWS, FRAMES, 3))
    places[..., 2] = np.cumsum(stream.uniform(-0.005, 0.04, (ROWS, FRAMES)), axis=1)
    places[..., 1] = 0.04 + 0.1 * (stream.uniform(size=(ROWS, FRAMES)) > 0.8)
    return stance_rows.foot_rows(places, RATE, (FOOT,), np.full(ROWS, FOOT.height))


@given(FLICKERS)
def test_runs_are_those_of_each_row(down):
    found = stance_rows.runs(down)
    expected = [(row, run.begin, run.end) for row in range(ROWS) for run in each(down[row])]
    assert list(zip(found.rows, found.begins, found.ends, strict=True)) == expected
    assert (found.mask(down.shape) == down).all()
    run, frame = found.frames()
    assert sorted(zip(found.rows[run], frame, strict=True)) == list(
        zip(*np.nonzero(down), strict=True)
    )


def each(down):
    return stances.runs(down, False)


@given(st.one_of(FLICKERS, CONTACTS))
def test_contacts_are_tidied_as_those_of_one_foot(down):
    expected = [stances.mask(stances.tidy(own, RATE, False), FRAMES) for own in down]
    assert (stance_rows.tidy(down, RATE) == expected).all()


@given(CONTACTS, st.integers(0, 99))
def test_swings_become_as_captured_ones_as_those_of_one_foot(down, seed):
    rows = feet(seed)
    down = stance_rows.tidy(down, RATE)
    expected = [
        stances.mask(
            stances.discipline(stances.tidy(own, RATE, False), FootPath(path, RATE), FOOT), FRAMES
        )
        for own, path in zip(down, rows.positions, strict=True)
    ]
    assert (stance_rows.discipline(down, rows) == expected).all()


@given(CONTACTS, FLICKERS)
def test_of_a_stance_out_of_reach_the_longest_part_stays(down, beyond):
    found = stance_rows.shortened(down, beyond, RATE)
    assert not (found & ~(down & ~beyond)).any()
    for row in range(ROWS):
        for stance in each(down[row]):
            inside = slice(stance.begin, stance.end)
            parts, left = each(~beyond[row, inside]), each(found[row, inside])
            longest = max(map(len, parts), default=0)
            assert [len(own) for own in left] == [longest] * (longest >= 3)
            first = next((own for own in parts if len(own) == longest), None)
            assert not left or left == [first]


def test_a_row_can_be_chosen():
    rows = feet(0)
    one = rows.select(np.array([2]))
    assert (one.positions == rows.positions[2:]).all() and (one.heights == rows.heights[2:]).all()
    assert (rows.heights == rows.positions @ UP).all()
