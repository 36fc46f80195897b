"""Tests of blends: no jump of position or velocity, the ends, and the mixture of sigma."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from passages import PARENTS, character, smooth

from posefield.motion import skeleton
from posefield.performance.joins import blends, cut_search
from posefield.performance.passages.passage import RATE


def joints_of(passage):
    moved = skeleton.translations(character().bones, passage.roots)
    return skeleton.positions(PARENTS, passage.rotations, moved)


def joined(kind, seed=1, seconds=None):
    before, after = smooth(seed), smooth(seed + 100)
    cut = cut_search.find_cut(character(), before, after, range(20, 58), range(10))
    after = after.placed(cut.motion)
    return before, after, cut, blends.join(before, after, cut, kind, seconds)


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
    plain = joints_of(blends.join(before, after, cut, "cut"))
    jump = np.linalg.norm(np.diff(plain, n=2, axis=0), axis=-1).mean(axis=1) * RATE
    assert jump[cut.exit - 2 : cut.exit + 1].max() > near.max()


@pytest.mark.parametrize("kind", ["dead", "hermite", "cut"])
def test_a_join_begins_and_ends_as_its_passages(kind):
    before, after, cut, found = joined(kind)
    last = round(blends.SECONDS[kind] * RATE)
    assert len(found) == cut.exit + len(after) - cut.entry
    assert np.array_equal(found.rotations[: cut.exit], before.rotations[: cut.exit])
    assert np.array_equal(found.roots[cut.exit + last :], after.roots[cut.entry + last :])
    rest = after.contacts[cut.entry :]
    assert np.array_equal(found.contacts, np.concatenate([before.contacts[: cut.exit], rest]))
    assert np.allclose(np.linalg.norm(found.rotations, axis=-1), 1.0)
    assert found.phases is None


def test_a_motion_that_goes_on_into_itself_is_kept():
    whole = smooth(7, 120)
    cut = cut_search.find_cut(character(), whole, whole.part(50, 120), range(50, 90), range(1, 2))
    found = blends.join(whole, whole.part(50, 120), cut, "hermite")
    assert cut.exit == 51
    assert joints_of(found) == pytest.approx(joints_of(whole), abs=1e-6)


def test_sigma_is_that_of_a_mixture():
    before, after, cut, _ = joined("dead")
    before = replace(before, sigmas=np.full(len(before), 0.02))
    after = replace(after, sigmas=np.full(len(after), 0.05))
    found = blends.join(before, after, cut, "dead").sigmas[cut.exit :]
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
    found = blends.join(
        replace(before, rotations=spinning), replace(after, rotations=still), cut, "dead"
    )
    steps = np.abs(np.sum(found.rotations[1:, 7] * found.rotations[:-1, 7], axis=-1))
    # Neighbours are at most 20 degrees apart.
    assert steps.min() > np.cos(np.radians(10.0))


def test_a_blend_ends_with_a_short_passage():
    before, after, cut, _ = joined("dead")
    short = after.part(0, cut.entry + 10)
    found = blends.entered(before, short, cut, "dead")
    assert np.array_equal(found.roots[-1], short.roots[-1])
    single = blends.entered(before, after.part(0, cut.entry + 1), cut, "dead")
    assert len(single) == 1
