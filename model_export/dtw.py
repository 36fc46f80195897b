"""Dynamic time warping with a limited slope, of many sequences to one at once."""

import numpy as np

from service.motion.conventions import Floats, Indices

# How far each step goes (in the sequence, in the reference): no step stands still, and the slope
# stays within a third and three, so that no pose is frozen (Sakoe & Chiba 1978).
STEPS = ((1, 1), (1, 2), (2, 1), (1, 3), (3, 1))


def warp(sequences: Floats, reference: Floats) -> Floats:
    """Reference phase (N, F) in [0, 1] at each of the F frames of sequences (N, F, features).

    reference (F, features), or one for each sequence (N, F, features), has as many frames as the
    sequences: resample them first, so that the slope limit means the same for all. The end points
    are fixed. Cells that a step jumps over are paid for, so that long steps bring no gain.
    """
    costs = _distances(sequences, reference)
    best, choices = _accumulate(costs)
    assert np.isfinite(best[:, -1, -1]).all()
    return np.stack([_phase(choice) for choice in choices])


def total_cost(sequences: Floats, reference: Floats) -> Floats:
    """Cost (N,) of the best warp of each sequence to the reference."""
    return _accumulate(_distances(sequences, reference))[0][:, -1, -1]


def _distances(sequences: Floats, reference: Floats) -> Floats:
    """Squared distances (N, F, F) between every frame and every reference frame."""
    squares = np.sum(np.square(sequences), axis=-1)[:, :, None]
    cross = sequences @ np.swapaxes(reference, -1, -2)
    own = np.sum(np.square(reference), axis=-1)[..., None, :]
    return np.maximum(squares + own - 2.0 * cross, 0.0)


def _accumulate(costs: Floats) -> tuple[Floats, Indices]:
    """Least cost of reaching every cell (N, F, F) and the step that reached it.

    No step stays in its row, so a whole row of every sequence is one array operation.
    """
    count, rows, columns = costs.shape
    best = np.full(costs.shape, np.inf)
    choices = np.zeros(costs.shape, dtype=np.int64)
    best[:, 0, 0] = costs[:, 0, 0]
    for row in range(1, rows):
        reached = np.full((len(STEPS), count, columns), np.inf)
        for index, (down, right) in enumerate(STEPS):
            if down <= row:
                before = best[:, row - down, : columns - right]
                reached[index, :, right:] = before + _toll(costs, row, down, right)
        choices[:, row] = np.argmin(reached, axis=0)
        best[:, row] = np.min(reached, axis=0)
    return best, choices


def _toll(costs: Floats, row: int, down: int, right: int) -> Floats:
    """Cost of a step into every column from `right` on, its jumped cells counted as a path.

    Each step pays by how far it goes in both directions together, so that the length of a path
    does not depend on the steps it takes.
    """
    columns = costs.shape[2]
    cells = max(down, right)
    toll = np.zeros((costs.shape[0], columns - right))
    for cell in range(cells):
        i, j = min(cell, down - 1), min(cell, right - 1)
        toll += costs[:, row - i, right - j : columns - j]
    return toll * (down + right) / cells


def _phase(choice: Indices) -> Floats:
    """Reference phase at every frame of one sequence, read back along the chosen steps."""
    row, column = choice.shape[0] - 1, choice.shape[1] - 1
    rows, columns = [row], [column]
    while row > 0:
        down, right = STEPS[int(choice[row, column])]
        row, column = row - down, column - right
        rows.append(row)
        columns.append(column)
    path = np.interp(np.arange(choice.shape[0]), rows[::-1], columns[::-1])
    return path / (choice.shape[1] - 1)
