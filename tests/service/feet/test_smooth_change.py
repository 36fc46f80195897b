"""Paths of many feet at once, against a dense system for each."""

import numpy as np
import one_foot
import pytest
from few_feet import foot_rows

from posefield.feet import ball_path, smooth_change, stance_rows
from posefield.feet.stances import Cycle, FootPath, Interval
from posefield.motion.foot_contacts import FootContact

RATE = 60.0
FOOT = FootContact(0, 0.04, 0.3, 0.5, 0.05)
# Stances begin in the first and in the last frames of a cycle, and lie all around it.
BEGINS = (0, 1, 30, 47, 48, 49)


def paths(rng, cyclic):
    """Return paths of different lengths with two stances, or one all around a cycle."""
    found, held = [], []
    for number, begin in enumerate(BEGINS):
        count = 50 + number * cyclic
        places = np.cumsum(rng.normal(size=(count, 3)), axis=0) * 0.01
        cycle = Cycle(complex(*rng.normal(size=2)), float(rng.normal())) if cyclic else None
        found.append(FootPath(places, RATE + number, cycle))
        if cyclic:
            first, second = begin % count, (begin + 25) % count
            both = [Interval(first, first + 9), Interval(second, second + 4)]
            held.append(sorted(both, key=lambda own: own.begin))
        else:
            held.append([Interval(5, 9), Interval(20 + number, 40)])
    if cyclic:
        held[2] = [Interval(0, len(found[2]))]
    held[3] = []
    return found, held


@pytest.mark.parametrize("cyclic", [False, True])
def test_paths_are_those_of_dense_systems(rng, cyclic):
    every, held = paths(rng, cyclic)
    feet = foot_rows(every, FOOT)
    runs = stance_rows.from_intervals(held)
    floor = smooth_change.smooth_change(feet, feet.floor, runs)
    values = rng.normal(size=len(runs.rows))
    heights = smooth_change.smooth_change(feet, feet.heights, runs, values)
    parts = [feet.rows.groups.split(own) for own in (floor, heights)]
    for row, (path, own) in enumerate(zip(every, held, strict=True)):
        dense = one_foot.smooth_change(path.floor, own, path.rate, path.cycle)
        assert np.abs(parts[0][row] - dense).max() < 1e-9
        level = Cycle(0.0, 0.0) if cyclic else None
        given = values[runs.rows == row]
        dense = one_foot.smooth_change(path.heights, own, path.rate, level, given)
        assert np.abs(parts[1][row] - dense).max() < 1e-9
    # A stance holds its path.
    assert np.abs(parts[0][0] - every[0].floor).max() > 1e-3


@pytest.mark.parametrize("cyclic", [False, True])
def test_a_path_has_the_same_bytes_alone(rng, cyclic):
    every, held = paths(rng, cyclic)
    free = [np.full(own.positions.shape, np.nan) for own in every]
    runs = stance_rows.from_intervals(held)
    feet = foot_rows(every, FOOT)
    whole = feet.rows.groups.split(ball_path.plan_paths(feet, runs, np.concatenate(free)))
    for path, own, goal, found in zip(every, held, free, whole, strict=True):
        one = ball_path.plan_paths(foot_rows([path], FOOT), stance_rows.from_intervals([own]), goal)
        assert one.tobytes() == found.tobytes()


@pytest.mark.parametrize("cyclic", [False, True])
def test_feet_keep_their_places_around_stances_as_one_foot_does(rng, cyclic):
    every, held = paths(rng, cyclic)
    led = [np.zeros(len(own), bool) for own in every]
    if not cyclic:
        led[0][12] = led[1][45] = led[2][3] = True
    found = ball_path.held(
        foot_rows(every, FOOT), stance_rows.from_intervals(held), np.concatenate(led)
    )
    goals = [np.where(own[:, None], 0.0, np.nan) * np.ones(3) for own in led]
    expected = [
        one_foot.held(path, own, goal) for path, own, goal in zip(every, held, goals, strict=True)
    ]
    own = [[(one.begin, one.end) for one in row] for row in found.by_row(len(every))]
    assert own == [[(one.begin, one.end) for one in row] for row in expected]
