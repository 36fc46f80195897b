"""Tests of passages and of rigid motions over the floor."""

import numpy as np
import pytest

from posefield.motion import quat
from posefield.performance.passages.passage import FloorMotion, Passage


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
    assert len(found.part(1, 3)) == 2
    assert found.part(1, 3).phases is None
    assert replace_phase(own).part(1, 3).phases == pytest.approx([0.25, 0.5])


def replace_phase(own):
    """Return a passage with phases."""
    return Passage(own.rotations, own.roots, own.contacts, own.sigmas, np.arange(4) / 4)
