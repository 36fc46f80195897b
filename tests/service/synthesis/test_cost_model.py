"""Tests of the measured cost of a pose: per level, and monotonic."""

import time
from dataclasses import replace

import numpy as np
import pytest

from posefield.inference import cost_model, session


@pytest.fixture(scope="module")
def opened(model_path):
    return session.load(model_path)


class Slow:
    """A graph whose levels let the clock run on by so many seconds a call."""

    def __init__(self, real, clock, seconds):
        self.real, self.clock, self.seconds = real, clock, seconds
        self.calls = [0] * len(seconds)

    def run(self, values, feed, level):
        assert {len(rows) for rows in feed.values()} == {cost_model.ROWS_PER_CALL}
        self.clock[0] += self.seconds[level]
        self.calls[level] += 1
        return self.real.run(values, feed, level)


@pytest.fixture
def paced(opened, monkeypatch):
    """Session whose levels take given milliseconds a call by a clock of its own."""
    clock = [0.0]
    monkeypatch.setattr(time, "perf_counter", lambda: clock[0])

    def build(*milliseconds):
        levels = opened.card.levels[: len(milliseconds)]
        graph = Slow(opened.graph, clock, [m / 1e3 for m in milliseconds])
        return replace(opened, card=replace(opened.card, levels=levels), graph=graph)

    return build


def test_every_level_has_a_cost(opened):
    found = cost_model.seconds_per_pose(opened)
    assert len(found) == len(opened.card.levels) == 4
    assert all(seconds > 0.0 for seconds in found)
    assert sorted(found, reverse=True) == list(found)


def test_a_cost_is_that_of_its_level_by_the_pose(paced):
    found = cost_model.seconds_per_pose(paced(512, 256, 128))
    assert found == pytest.approx([1e-3, 0.5e-3, 0.25e-3])
    assert found != pytest.approx([0.25e-3, 0.5e-3, 1e-3])


def test_a_coarser_level_that_is_slower_costs_what_the_finer_one_does(paced):
    assert cost_model.seconds_per_pose(paced(512, 600, 128)) == pytest.approx([1e-3, 1e-3, 0.25e-3])


def test_costs_never_grow(rng):
    costs = rng.uniform(1.0, 2.0, 20)
    found = np.array(cost_model.monotone_costs(costs))
    assert np.all(np.diff(found) <= 0.0) and np.all(found <= costs)
    assert np.any(np.diff(costs) > 0.0)
