"""Tests of the search of cuts: against brute force, and its rules for ties."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from passages import PARENTS, character, smooth
from scipy.optimize import minimize

from posefield.motion import skeleton
from posefield.performance.joins import cut_search
from posefield.performance.passages.passage import RATE, FloorMotion


def joints_of(passage):
    moved = skeleton.translations(character().bones, passage.roots)
    return skeleton.positions(PARENTS, passage.rotations, moved)


def cost(before, after, exit_frame, entry, motion):
    """The cost of a pair, written out."""
    own, other = joints_of(before), joints_of(after.placed(motion))
    weights = np.ones(len(PARENTS))
    for foot, leg in enumerate(character().legs):
        if before.contacts[exit_frame, foot] > 0.5 and after.contacts[entry, foot] > 0.5:
            weights[leg.tip] = cut_search.FOOT_WEIGHT
    speed, toward = np.gradient(own, 1 / RATE, axis=0), np.gradient(other, 1 / RATE, axis=0)
    apart = weights @ np.sum(np.square(own[exit_frame] - other[entry]), axis=-1)
    faster = np.sum(np.square(speed[exit_frame] - toward[entry]))
    return (apart + 0.15**2 * faster) / len(PARENTS)


def moved(number):
    return FloorMotion(number[0], complex(*number[1:]))


@given(st.integers(0, 10_000))
def test_the_found_motion_costs_least(seed):
    before, after = smooth(seed), smooth(seed + 1).placed(FloorMotion(0.5, 3.0 - 2.0j))
    frame, entry = seed % 60, seed % 7
    found = cut_search.find_cut(
        character(), before, after, range(frame, frame + 1), range(entry, entry + 1)
    )
    assert found.cost == pytest.approx(cost(before, after, frame, entry, found.motion), abs=1e-10)
    start = [found.motion.turn, found.motion.shift.real, found.motion.shift.imag]
    best = minimize(lambda x: cost(before, after, frame, entry, moved(x)), start, method="BFGS")
    assert best.fun >= found.cost - 1e-9
    beside = [start[0] + 0.01, *start[1:]]
    assert cost(before, after, frame, entry, moved(beside)) > found.cost + 1e-7


def test_the_best_pair_is_that_of_brute_force():
    before, after = smooth(1), smooth(2)
    exits, entries = range(30, 60), range(12)
    found = cut_search.find_cut(character(), before, after, exits, entries)
    pairs = [
        (
            cut_search.find_cut(character(), before, after, range(e, e + 1), range(b, b + 1)).cost,
            e,
            b,
        )
        for e in exits
        for b in entries
    ]
    assert (found.cost, found.exit, found.entry) == pytest.approx(min(pairs))
    assert max(pairs)[0] > 2.0 * found.cost
    assert cut_search.find_cut(character(), before, after, exits, entries) == found


def test_a_given_motion_is_kept():
    before, after = smooth(1), smooth(2)
    exits, entries, given_motion = range(30, 60), range(12), FloorMotion(0.2, 0.8 + 0.1j)
    found = cut_search.find_cut(character(), before, after, exits, entries, given_motion)
    costs = {(e, b): cost(before, after, e, b, given_motion) for e in exits for b in entries}
    assert found.motion == given_motion
    assert (found.exit, found.entry) == min(costs, key=costs.get)
    assert found.cost == pytest.approx(min(costs.values()), abs=1e-10)
    free = cut_search.find_cut(character(), before, after, exits, entries)
    assert free.cost < found.cost


def test_a_motion_goes_on_into_itself_wherever_it_lies():
    before, by = smooth(3, 90), FloorMotion(1.0, 2.0 + 1.0j)
    after = before.part(40, 90).placed(by)
    found = cut_search.find_cut(character(), before, after, range(20, 80), range(1, 10))
    # Frames 1 to 9 of the part fit equally: the earliest exit is taken.
    assert (found.exit, found.entry) == (41, 1)
    assert found.distance == pytest.approx(0.0, abs=1e-7)
    back = by.inverse()
    assert found.motion.turn == pytest.approx(back.turn)
    assert found.motion.shift == pytest.approx(back.shift)


def test_nothing_to_search_is_refused():
    with pytest.raises(ValueError, match="0 exits and 5 entries"):
        cut_search.find_cut(character(), smooth(1), smooth(2), range(0), range(5))
