"""Tests of blends: no jump of position or velocity, the ends, and the mixture of sigma."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from passages import PARENTS, character, smooth
from scipy.optimize import minimize

from posefield.motion import quat, skeleton
from posefield.performance import joins
from posefield.performance.passage import RATE, FloorMotion, Passage


def joints_of(passage):
    moved = skeleton.translations(character().bones, passage.roots)
    return skeleton.positions(PARENTS, passage.rotations, moved)


def joined(kind, seed=1, seconds=None):
    before, after = smooth(seed), smooth(seed + 100)
    cut = joins.find_cut(character(), before, after, range(20, 58), range(10))
    after = after.placed(cut.motion)
    return before, after, cut, joins.join(before, after, cut, kind, seconds)


@given(st.integers(0, 1000), st.sampled_from(["dead", "hermite"]))
def test_a_blend_has_no_jump(seed, kind):
    before, after, cut, found = joined(kind, seed)
    points, own = joints_of(found), joints_of(before)
    assert points[cut.exit] == pytest.approx(own[cut.exit], abs=1e-9)
    speeds = np.linalg.norm(np.diff(points, n=2, axis=0), axis=-1).mean(axis=1) * RATE
    usual = max(
        np.linalg.norm(np.diff(joints_of(each), n=2, axis=0), axis=-1).mean(axis=1).max() * RATE
        for each in (before, after)
    )
    # Velocities change from frame to frame a few times as much as in either passage, at most.
    near = speeds[cut.exit - 2 : cut.exit + 3]
    # The velocity of the dead blend decays by a twelfth a frame from the cut on.
    fast = np.linalg.norm(np.diff(own, axis=0), axis=-1).mean(axis=1).max() * RATE
    assert near.max() < 3.0 * usual + 0.2 * fast
    plain = joints_of(joins.join(before, after, cut, "cut"))
    jump = np.linalg.norm(np.diff(plain, n=2, axis=0), axis=-1).mean(axis=1) * RATE
    assert jump[cut.exit - 2 : cut.exit + 1].max() > near.max()


@pytest.mark.parametrize("kind", ["dead", "hermite", "cut"])
def test_a_join_begins_and_ends_as_its_passages(kind):
    before, after, cut, found = joined(kind)
    last = round(joins.SECONDS[kind] * RATE)
    assert len(found) == cut.exit + len(after) - cut.entry
    assert np.array_equal(found.rotations[: cut.exit], before.rotations[: cut.exit])
    assert np.array_equal(found.roots[cut.exit + last :], after.roots[cut.entry + last :])
    rest = after.contacts[cut.entry :]
    assert np.array_equal(found.contacts, np.concatenate([before.contacts[: cut.exit], rest]))
    assert np.allclose(np.linalg.norm(found.rotations, axis=-1), 1.0)
    assert found.phases is None


def test_sigma_is_that_of_a_mixture():
    before, after, cut, _ = joined("dead")
    before = replace(before, sigmas=np.full(len(before), 0.02))
    after = replace(after, sigmas=np.full(len(after), 0.05))
    found = joins.join(before, after, cut, "dead").sigmas[cut.exit :]
    assert found[0] == pytest.approx(0.02)
    assert found[30] == 0.05
    middle = np.sqrt((0.02**2 + 0.05**2) / 2.0 + cut.distance**2 / 4.0)
    assert found[15] == pytest.approx(middle)


def test_offsets_of_more_than_half_a_turn_do_not_flip():
    before, after, cut, _ = joined("dead")
    spinning = before.rotations.copy()
    angles = 3.0 + 4.0 * (np.arange(len(before)) - cut.exit) / RATE
    spinning[:, 7] = np.stack([np.cos(angles / 2), 0 * angles, np.sin(angles / 2), 0 * angles], 1)
    still = after.rotations.copy()
    still[:, 7] = [1.0, 0.0, 0.0, 0.0]
    found = joins.join(
        replace(before, rotations=spinning), replace(after, rotations=still), cut, "dead"
    )
    steps = np.abs(np.sum(found.rotations[1:, 7] * found.rotations[:-1, 7], axis=-1))
    # Neighbours are at most 20 degrees apart.
    assert steps.min() > np.cos(np.radians(10.0))


def cost(before, after, exit_frame, entry, motion):
    """The cost of a pair, written out."""
    own, other = joints_of(before), joints_of(after.placed(motion))
    weights = np.ones(len(PARENTS))
    for foot, leg in enumerate(character().legs):
        if before.contacts[exit_frame, foot] > 0.5 and after.contacts[entry, foot] > 0.5:
            weights[leg.tip] = joins.FOOT_WEIGHT
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
    found = joins.find_cut(
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
    found = joins.find_cut(character(), before, after, exits, entries)
    pairs = [
        (joins.find_cut(character(), before, after, range(e, e + 1), range(b, b + 1)).cost, e, b)
        for e in exits
        for b in entries
    ]
    assert (found.cost, found.exit, found.entry) == pytest.approx(min(pairs))
    assert max(pairs)[0] > 2.0 * found.cost
    assert joins.find_cut(character(), before, after, exits, entries) == found


def test_a_given_motion_is_kept():
    before, after = smooth(1), smooth(2)
    exits, entries, given_motion = range(30, 60), range(12), FloorMotion(0.2, 0.8 + 0.1j)
    found = joins.find_cut(character(), before, after, exits, entries, given_motion)
    costs = {(e, b): cost(before, after, e, b, given_motion) for e in exits for b in entries}
    assert found.motion == given_motion
    assert (found.exit, found.entry) == min(costs, key=costs.get)
    assert found.cost == pytest.approx(min(costs.values()), abs=1e-10)
    free = joins.find_cut(character(), before, after, exits, entries)
    assert free.cost < found.cost


def test_a_motion_goes_on_into_itself_wherever_it_lies():
    before, by = smooth(3, 90), FloorMotion(1.0, 2.0 + 1.0j)
    after = before.part(40, 90).placed(by)
    found = joins.find_cut(character(), before, after, range(20, 80), range(1, 10))
    # Frames 1 to 9 of the part fit equally: the earliest exit is taken.
    assert (found.exit, found.entry) == (41, 1)
    assert found.distance == pytest.approx(0.0, abs=1e-7)
    back = by.inverse()
    assert found.motion.turn == pytest.approx(back.turn)
    assert found.motion.shift == pytest.approx(back.shift)


def test_a_motion_after_another_and_back_is_none():
    first, second = FloorMotion(0.4, 1.0 + 2.0j), FloorMotion(-1.1, 0.5j)
    points = np.random.default_rng(1).normal(size=(5, 3))
    both = second.after(first)
    assert np.allclose(both.place(points), second.place(first.place(points)))
    assert not np.allclose(both.place(points), first.place(second.place(points)))
    assert np.allclose(both.inverse().place(both.place(points)), points)


def test_a_placed_passage_moves_as_one_body():
    rng = np.random.default_rng(2)
    turned = quat.normalize(rng.normal(size=(4, 3, 4)))
    own = Passage(turned, rng.normal(size=(4, 3)), np.zeros((4, 2)), np.zeros(4))
    by = FloorMotion(0.7, 2.0 - 1.0j)
    found = own.placed(by)
    assert np.allclose(found.roots, by.place(own.roots))
    # A point that is fixed to the root moves with it.
    point = np.array([0.1, 0.2, 0.3])
    before = own.roots + quat.rotate(own.rotations[:, 0], point)
    assert np.allclose(found.roots + quat.rotate(found.rotations[:, 0], point), by.place(before))
    assert np.array_equal(found.rotations[:, 1:], own.rotations[:, 1:])
    assert found.part(1, 3).phases is None
    phased = replace(own, phases=np.arange(4) / 4).part(1, 3)
    assert len(phased) == 2 and phased.phases == pytest.approx([0.25, 0.5])
