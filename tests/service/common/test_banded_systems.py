"""Long systems of five diagonals, against the dense solution."""

import numpy as np
import pytest

from posefield.feet import smooth_change


def system(rng, size):
    """A positive definite matrix of five diagonals, and its bands."""
    lower = np.tril(np.triu(rng.normal(size=(size, size)), -2))
    matrix = lower @ lower.T + 0.1 * np.eye(size)
    matrix[np.abs(np.subtract.outer(np.arange(size), np.arange(size))) > 2] = 0.0
    bands = np.zeros((3, size))
    for apart in range(min(3, size)):
        bands[apart, : size - apart] = np.diag(matrix, apart)
    return matrix, bands


def solve(bands, goal, known=None, values=None):
    """Solve one system for one real right side."""
    known = np.zeros(len(goal), bool) if known is None else known
    values = np.zeros(len(goal)) if values is None else values
    sides = (goal[None, :, None], known[:, None], values[None, :, None])
    return smooth_change.solve(bands[:, :, None], *sides)[0, :, 0]


@pytest.mark.parametrize("size", [1, 2, 3, 4, 5, 8, 17, 64, 301])
def test_the_solution_is_that_of_the_dense_system(rng, size):
    matrix, bands = system(rng, size)
    goal = rng.normal(size=size)
    found = solve(bands, goal)
    assert found == pytest.approx(np.linalg.solve(matrix, goal), rel=1e-8, abs=1e-9)
    product = smooth_change.product(bands[:, :, None], found[None, :, None])
    assert product[0, :, 0] == pytest.approx(goal, abs=1e-8)
    wrong = bands.copy()
    wrong[0] *= 1.001
    assert np.abs(solve(wrong, goal) - found).max() > 1e-6


def test_known_values_are_kept_exactly(rng):
    matrix, bands = system(rng, 40)
    goal, values = rng.normal(size=40), rng.normal(size=40)
    known = rng.random(40) < 0.3
    found = solve(bands, goal, known, values)
    assert np.array_equal(found[known], values[known])
    rest = goal[~known] - matrix[np.ix_(~known, known)] @ values[known]
    assert found[~known] == pytest.approx(np.linalg.solve(matrix[np.ix_(~known, ~known)], rest))
    assert np.array_equal(solve(bands, goal, np.ones(40, bool), values), values)


def test_systems_have_the_same_bytes_alone_and_beside_larger_ones(rng):
    sizes = (3, 64, 17, 40, 33)
    bands, goal = np.zeros((3, max(sizes), len(sizes))), np.zeros((2, max(sizes), len(sizes)))
    bands[0] = 1.0
    known, nothing = np.ones(bands.shape[1:], bool), np.zeros(goal.shape)
    alone = []
    for place, size in enumerate(sizes):
        own, right = system(rng, size)[1], rng.normal(size=(2, size))
        bands[:, :size, place], goal[:, :size, place] = own, right
        known[:size, place] = False
        sides = (right[:, :, None], np.zeros((size, 1), bool), np.zeros((2, size, 1)))
        alone.append(smooth_change.solve(own[:, :, None], *sides)[:, :, 0])
    found = smooth_change.solve(bands, goal, known, nothing)
    for place, (size, own) in enumerate(zip(sizes, alone, strict=True)):
        assert np.array_equal(found[:, :size, place], own)
