"""The path of a foot: the smoothest change that stands, against the quadratic form it minimises."""

import numpy as np
import pytest
from few_feet import FootPath, change_smoothly, foot_rows, plan_path

from posefield.feet import ball_path, smooth_change, stance_rows
from posefield.feet.stance_rows import Cycle
from posefield.locomotion import floor_plane
from posefield.motion.contact_detection import FootContact

RATE = 60.0
FOOT = FootContact(0, 0.04, 0.3, 0.5, 0.05)


def energy(change, cycle=None):
    """Sum of |d|² + (tau r)⁴ |D² d|²; over the end of a cycle the change is turned."""
    if cycle is None:
        bends = np.diff(change, 2)
    else:
        turned = cycle.factor
        around = np.concatenate([[change[-1] / turned], change, [change[0] * turned]])
        bends = np.diff(around, 2)
    stiffness = (smooth_change.SPREAD * RATE) ** 4
    return np.sum(np.abs(change) ** 2) + stiffness * np.sum(np.abs(bends) ** 2)


@pytest.mark.parametrize("cycle", [None, Cycle(0.8 + 0.1j, np.exp(0.4j)), Cycle(0.9, 1.0)])
def test_no_other_path_that_stands_changes_less(rng, cycle):
    path = np.cumsum(rng.normal(size=50) + 1j * rng.normal(size=50)) * 0.01
    held = [range(5, 17), range(40, 55 if cycle else 50)]
    found = change_smoothly(path, held, RATE, FOOT, cycle)
    least = energy(found - path, cycle)
    for _ in range(20):
        change = change_that_stands(rng, held, cycle)
        more, less = (energy(found + by * change - path, cycle) for by in (1.0, -1.0))
        # At the least of a quadratic form both ways cost the same.
        assert min(more, less) > least and abs(more - less) < 1e-9 * energy(change, cycle)
    aside = found + 1e-3 * change
    more, less = (energy(aside + by * change - path, cycle) for by in (1.0, -1.0))
    assert more - less > 1e-4 * energy(change, cycle)


def change_that_stands(rng, held, cycle):
    """A change of 50 frames that is one vector in each interval, turned in the next cycle."""
    found = rng.normal(size=50) + 1j * rng.normal(size=50)
    for interval in held:
        frames = np.arange(interval.start, interval.stop)
        turned = np.where(frames >= 50, 1.0 / (cycle.factor if cycle else 1.0), 1.0)
        found[frames % 50] = found[interval.start] * turned
    return found


def test_a_foot_keeps_one_place_in_each_stance(rng):
    path = FootPath(np.cumsum(rng.normal(size=(80, 3)), axis=0) * 0.01, RATE)
    held = (range(20), range(40, 66))
    found = plan_path(path, held, FOOT)
    for stance, anchor in zip(found.stances, found.anchors, strict=True):
        apart = found.positions[stance.start : stance.stop] - anchor
        assert not apart[:, ::2].any()
        # Heights follow the prediction, within bounds.
        assert np.abs(anchor[1] + apart[:, 1] - FOOT.height).max() <= stance_rows.UNEVEN
    assert (found.positions[:, 1] >= FOOT.height - stance_rows.SUNK).all()


def test_a_long_path_is_that_of_its_parts():
    # 20,000 frames: as a dense system they would take 3 GB.
    frames, period = 20_000, 80
    times = np.arange(frames) / RATE
    path = 1.2 * times + 0.05j * np.sin(times)
    held = [range(first, first + 40) for first in range(0, frames - period, period)]
    whole = change_smoothly(path, held, RATE, FOOT)
    part = change_smoothly(path[8000:9600], held[:19], RATE, FOOT)
    # A change falls by e every 0.14 s: four seconds from an end it is the same.
    assert whole[8240:9120] == pytest.approx(part[240:-480], abs=1e-9)
    assert np.abs(whole[8000:8040] - part[:40]).max() > 1e-6


def test_a_dragged_swing_is_lifted_and_a_lifted_one_is_not():
    ahead = np.concatenate([np.zeros(20), np.linspace(0.0, 0.4, 20), np.full(20, 0.4)])
    positions = floor_plane.at_height(ahead + 0j, np.full(60, 0.04))
    held = [range(20), range(40, 60)]
    low = plan_path(FootPath(positions, RATE), held, FOOT)
    highest = FOOT.height + ball_path.LIFT_SHARE * FOOT.clearance
    assert low.positions[:, 1].max() == pytest.approx(highest, abs=2e-3)
    lifted = positions.copy()
    lifted[20:40, 1] += 0.2 * np.sin(np.pi * np.linspace(0.0, 1.0, 20)) ** 2
    high = plan_path(FootPath(lifted, RATE), held, FOOT)
    assert high.positions[:, 1].max() == pytest.approx(lifted[:, 1].max(), abs=5e-3)


def test_a_foot_leaves_the_floor_and_comes_back_at_rest():
    """The knee of a straight leg jumps where a foot is lifted by a centimetre in one frame."""
    places = np.zeros((60, 3))
    places[:, 1], places[:, 2] = FOOT.height, np.repeat([0.0, 0.0, 0.15], [20, 20, 20])
    found = [range(20), range(40, 60)]
    planned = plan_path(FootPath(places, RATE), found, FOOT).positions
    heights = planned[:, 1] - FOOT.height
    first, last = heights[20], heights[39]
    assert max(first, last) < 0.1 * heights.max()
    # A sine to the power of 0.7 rises by a quarter in the first frame.
    steep = np.sin(np.pi * np.arange(1, 21) / 21.0) ** 0.7
    assert steep[0] > 0.25 * steep.max()


# Stances begin in the first and in the last frames of a cycle, and lie all around it.
BEGINS = (0, 1, 30, 47, 48, 49)


def paths(rng, cyclic):
    """Return paths of different lengths with two stances, or one all around a cycle."""
    found, held = [], []
    for number, begin in enumerate(BEGINS):
        count = 50 + number * cyclic
        places = np.cumsum(rng.normal(size=(count, 3)), axis=0) * 0.01
        cycle = Cycle(complex(*rng.normal(size=2)), np.exp(1j * rng.normal())) if cyclic else None
        found.append(FootPath(places, RATE + number, cycle))
        if cyclic:
            first, second = begin % count, (begin + 25) % count
            both = [range(first, first + 9), range(second, second + 4)]
            held.append(sorted(both, key=lambda own: own.start))
        else:
            held.append([range(5, 9), range(20 + number, 40)])
    if cyclic:
        held[2] = [range(len(found[2]))]
    held[3] = []
    return found, held


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
