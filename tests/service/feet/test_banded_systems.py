"""Long systems of five diagonals, against the dense solution."""

import numpy as np
import pytest

from posefield.feet import banded_systems


def system(rng, size):
    """A positive definite matrix of five diagonals, and its bands."""
    lower = np.tril(np.triu(rng.normal(size=(size, size)), -2))
    matrix = lower @ lower.T + 0.1 * np.eye(size)
    matrix[np.abs(np.subtract.outer(np.arange(size), np.arange(size))) > 2] = 0.0
    bands = np.zeros((3, size))
    for apart in range(min(3, size)):
        bands[apart, : size - apart] = np.diag(matrix, apart)
    return matrix, bands


@pytest.mark.parametrize("size", [1, 2, 3, 4, 5, 8, 17, 64, 301])
def test_the_solution_is_that_of_the_dense_system(rng, size):
    matrix, bands = system(rng, size)
    goal = rng.normal(size=size) + 1j * rng.normal(size=size)
    found = banded_systems.solve(bands, goal, np.zeros(size, bool), np.zeros(size))
    assert found == pytest.approx(np.linalg.solve(matrix, goal), rel=1e-8, abs=1e-9)
    assert banded_systems.product(bands, found) == pytest.approx(goal, abs=1e-8)
    wrong = bands.copy()
    wrong[0] *= 1.001
    other = banded_systems.solve(wrong, goal, np.zeros(size, bool), np.zeros(size))
    assert np.abs(other - found).max() > 1e-6


def test_known_values_are_kept_exactly(rng):
    matrix, bands = system(rng, 40)
    goal, values = rng.normal(size=40), rng.normal(size=40)
    known = rng.random(40) < 0.3
    found = banded_systems.solve(bands, goal, known, values)
    assert np.array_equal(found[known], values[known])
    rest = goal[~known] - matrix[np.ix_(~known, known)] @ values[known]
    assert found[~known] == pytest.approx(np.linalg.solve(matrix[np.ix_(~known, ~known)], rest))
    assert np.array_equal(banded_systems.solve(bands, goal, np.ones(40, bool), values), values)
