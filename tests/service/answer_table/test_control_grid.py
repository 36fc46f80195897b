"""Tests of the grid over the controls, of its refinement, and of the compression of its rows."""

import numpy as np
import pytest

from posefield.answer_table import control_grid, row_compression
from posefield.answer_table.control_grid import ControlGrid
from posefield.model_file.answer_bounds import AnswerBounds

GRID = ControlGrid((np.array([0.0, 1.0, 4.0]), np.array([-1.0, 2.0])))
BOUNDS = AnswerBounds(np.array([0.0, 0.0]), np.array([1.0, 2.0]), (1.0, 2.0))


def test_interpolation_is_exact_for_polynomials():
    rng = np.random.default_rng(5)
    points = rng.uniform([0.0, -1.0], [4.0, 2.0], (200, 2))

    def bilinear(at):
        return 3.0 - 2.0 * at[:, 0] + 0.5 * at[:, 1] + 0.25 * at[:, 0] * at[:, 1]

    indices, weights = GRID.corners(points)
    found = np.sum(weights * bilinear(GRID.points)[indices], axis=1)
    np.testing.assert_allclose(found, bilinear(points), atol=1e-12)
    np.testing.assert_allclose(weights.sum(axis=1), 1.0)
    squares = np.sum(weights * np.square(GRID.points[:, 0])[indices], axis=1)
    np.testing.assert_allclose(squares, np.square(points[:, 0]), atol=1e-12)
    # Negative control: three values hold no cube, and four do.
    cubes = np.sum(weights * (GRID.points[:, 0] ** 3)[indices], axis=1)
    assert np.abs(cubes - points[:, 0] ** 3).max() > 1.0
    wider = ControlGrid((np.array([0.0, 0.5, 1.0, 2.0, 4.0]),))
    indices, weights = wider.corners(points[:, :1])
    np.testing.assert_allclose(
        np.sum(weights * wider.points[indices, 0] ** 3, axis=1), points[:, 0] ** 3, atol=1e-12
    )


def test_points_of_the_grid_are_their_own_corners():
    indices, weights = GRID.corners(GRID.points)
    assert indices[weights != 0.0].tolist() == list(range(len(GRID)))


def test_the_grid_is_refined_where_the_error_is():
    def error(axis, low, high):
        return (high - low) ** 2 if axis == 0 and low >= 0.5 else 0.0

    grid = control_grid.refined(BOUNDS, error, 0.01, 1000)
    first, second = grid.axes
    assert second.tolist() == [-0.5, 0.0, 2.0, 2.5]
    assert first[:3].tolist() == [-0.25, 0.0, 1.0]
    assert np.diff(first[2:]).max() <= 0.1


def test_the_grid_stays_within_its_size_but_for_the_ends_of_the_ranges():
    def error(axis, low, high):
        return high - low

    assert len(control_grid.refined(BOUNDS, error, 0.0, 100)) in range(80, 101)
    assert len(control_grid.refined(BOUNDS, error, 0.0, 1)) == 16


def test_blocks_hold_numbers_to_half_a_step():
    rng = np.random.default_rng(2)
    numbers = rng.normal(size=(40, 3)) * [1e-3, 1.0, 200.0]
    found = row_compression.block("x", numbers, 1e-3)
    assert np.all(np.abs(found.numbers - numbers) <= 0.5001 * found.steps + 1e-5)
    assert found.steps[0] == 1e-3
    assert found.steps[2] == pytest.approx(np.abs(numbers[:, 2]).max() / row_compression.LARGEST)
    low, high = np.frombuffer(found.content, np.uint8).reshape(2, 3, 40).astype(int)
    signed = (low + 256 * high).astype(np.uint16).astype(np.int16)
    np.testing.assert_array_equal(signed, found.integers.T)


def test_rows_apart_from_the_others_are_among_the_components():
    rows = np.zeros((100, 30), np.float32)
    rows[:, 0] = np.arange(100)
    rows[[13, 57], 7] = 2.0
    found = row_compression.robust_components(rows, 1e-2, 10)
    back = found.mean + found.coefficients(rows) @ found.basis
    np.testing.assert_allclose(back, rows, atol=1e-3)
    # Negative control: even rows alone miss them.
    even = row_compression.components(rows[::11], 1e-2)
    assert even.distances(rows)[13] > 1.0


def test_components_give_back_rows_of_their_rank():
    rng = np.random.default_rng(3)
    rows = (rng.normal(size=(60, 4)) @ rng.normal(size=(4, 200)) + 5.0).astype(np.float32)
    found = row_compression.components(rows, 1e-2)
    assert found.basis.shape == (4, 200)
    np.testing.assert_allclose(found.basis @ found.basis.T, np.eye(4), atol=1e-5)
    back = found.mean + found.coefficients(rows) @ found.basis
    np.testing.assert_allclose(back, rows, atol=1e-3)
    # Negative control: a component less.
    fewer = row_compression.Components(found.mean, found.basis[:-1])
    assert np.abs(fewer.mean + fewer.coefficients(rows) @ fewer.basis - rows).max() > 0.1
