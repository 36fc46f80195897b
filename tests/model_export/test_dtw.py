"""Tests of dynamic time warping with limited slope."""

from functools import cache

import numpy as np

from posefield_train.align import dtw

TOLERANCE = 1e-9
LEAST, MOST = 1.0 / 3.0, 3.0


def best_path(sequence, reference):
    """Cost and cells of the best path, by plain recursion over the steps that are allowed."""
    costs = np.sum(np.square(sequence[:, None] - reference), axis=-1)

    def toll(i, j, down, right):
        # A long step passes every cell on its way; all steps pay for the distance they go.
        cells = [(i - min(k, down - 1), j - min(k, right - 1)) for k in range(max(down, right))]
        return (down + right) * float(np.mean([costs[cell] for cell in cells]))

    @cache
    def reach(i, j):
        if (i, j) == (0, 0):
            return float(costs[0, 0]), ((0, 0),)
        ways = [(np.inf, ())]
        for down, right in ((1, 1), (1, 2), (2, 1), (1, 3), (3, 1)):
            if i >= down and j >= right:
                cost, path = reach(i - down, j - right)
                ways.append((cost + toll(i, j, down, right), (*path, (i, j))))
        return min(ways)

    return reach(len(sequence) - 1, len(reference) - 1)


def wandering(rng, count, frames, features=2):
    return np.cumsum(rng.normal(size=(count, frames, features)), axis=1)


def test_cost_and_path_are_those_of_the_plain_recursion(rng):
    sequences, (reference,) = wandering(rng, 6, 12), wandering(rng, 1, 12)
    found, phases = dtw.total_cost(sequences, reference), dtw.warp(sequences, reference)
    for sequence, cost, phase in zip(sequences, found, phases, strict=True):
        expected, path = best_path(sequence, reference)
        rows, columns = np.array(path).T
        assert abs(cost - expected) < TOLERANCE
        assert np.max(np.abs(phase - np.interp(np.arange(12), rows, columns) / 11)) < TOLERANCE
        even = np.sum(np.square(sequence - reference)) * 2 - np.sum((sequence - reference)[0] ** 2)
        assert cost < even - 1e-3
        assert np.max(np.abs(phase - np.linspace(0.0, 1.0, 12))) > 1e-2


def test_slope_keeps_within_a_third_and_three(rng):
    sequences, (reference,) = wandering(rng, 30, 40), wandering(rng, 1, 40)
    slopes = np.diff(dtw.warp(sequences, reference), axis=1) * 39
    assert LEAST - TOLERANCE <= slopes.min() < LEAST + TOLERANCE
    assert MOST - TOLERANCE < slopes.max() <= MOST + TOLERANCE


def test_ends_meet_and_time_never_runs_backwards(rng):
    phases = dtw.warp(wandering(rng, 30, 40), wandering(rng, 1, 40)[0])
    assert np.array_equal(phases[:, [0, -1]], np.tile([0.0, 1.0], (30, 1)))
    assert np.diff(phases, axis=1).min() > 0.0
