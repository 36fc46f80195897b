"""Dynamic time warping with a slope limit (Sakoe & Chiba 1978), of many sequences in one pass."""

from collections.abc import Iterator
from typing import Annotated

import numpy as np

from posefield.common.units import ClipFrames, Floats, Indices, PerClip, Traces

# Frames of each step (in the sequence, in the reference). Every step advances in both, and the
# slope stays between 1/3 and 3, so that no pose is frozen (Sakoe & Chiba 1978).
STEP_PATTERN = ((1, 1), (1, 2), (2, 1), (1, 3), (3, 1))
# Sequences per block: at 100 frames their tables take 10 MB.
BATCH = 16


def warp(sequences: Traces, reference: Annotated[Floats, "... frames features"]) -> ClipFrames:
    """Return reference phases (N, F) in [0, 1] at each frame of sequences (N, F, features).

    reference: (F, features), or one per sequence (N, F, features), with as many frames as the
    sequences; resample them first, so that the slope limit means the same for all. The end points
    are fixed. The cells that a step skips are added to its cost, so that long steps have no
    advantage.
    """
    references = np.broadcast_to(reference, (len(sequences), *reference.shape[-2:]))
    starts = range(0, len(sequences), BATCH)
    return np.concatenate(
        [_batch_phases(sequences[i : i + BATCH], references[i : i + BATCH]) for i in starts]
    )


def _batch_phases(sequences: Traces, references: Traces) -> ClipFrames:
    costs = _distances(sequences, references)
    best, choices = _initial_costs(costs), np.zeros(costs.shape, dtype=np.int64)
    for row, reached in _accumulate(costs, best):
        choices[:, row] = np.argmin(reached, axis=0)
    assert np.isfinite(best[:, -1, -1]).all()
    return np.stack([_backtrack(choice) for choice in choices])


def total_cost(sequences: Traces, reference: Annotated[Floats, "... frames features"]) -> PerClip:
    """Return the cost (N,) of the best warp of each sequence to the reference."""
    costs = _distances(sequences, reference)
    best = _initial_costs(costs)
    for _row, _reached in _accumulate(costs, best):
        continue
    return best[:, -1, -1]


def _distances(
    sequences: Traces, reference: Annotated[Floats, "... frames features"]
) -> Annotated[Floats, "clips frames frames"]:
    """Return squared distances (N, F, F) between every frame and every reference frame."""
    squares = np.sum(np.square(sequences), axis=-1)[:, :, None]
    cross = sequences @ np.swapaxes(reference, -1, -2)
    reference_squares = np.sum(np.square(reference), axis=-1)[..., None, :]
    return np.maximum(squares + reference_squares - 2.0 * cross, 0.0)


def _initial_costs(
    costs: Annotated[Floats, "clips rows columns"],
) -> Annotated[Floats, "clips rows columns"]:
    """Return accumulated costs (N, F, F) before the first step, infinite but for the first cell."""
    best = np.full(costs.shape, np.inf)
    best[:, 0, 0] = costs[:, 0, 0]
    return best


def _accumulate(
    costs: Annotated[Floats, "clips rows columns"], best: Annotated[Floats, "clips rows columns"]
) -> Iterator[tuple[int, Floats]]:
    """Write the least accumulated cost of every cell to `best` (N, F, F), row by row.

    Yields each row's index and the costs (steps, N, F) of its cells by each step. Every step
    advances at least one row, so a row of all sequences is one array operation.
    """
    count, rows, columns = costs.shape
    tolls = [_step_costs(costs, down, right) for down, right in STEP_PATTERN]
    for row in range(1, rows):
        reached = np.full((len(STEP_PATTERN), count, columns), np.inf)
        for index, (down, right) in enumerate(STEP_PATTERN):
            if down <= row:
                before = best[:, row - down, : columns - right]
                np.add(before, tolls[index][:, row - down], out=reached[index, :, right:])
        np.min(reached, axis=0, out=best[:, row])
        yield row, reached


def _step_costs(
    costs: Annotated[Floats, "clips rows columns"], down: int, right: int
) -> Annotated[Floats, "clips rows-{down} columns-{right}"]:
    """Return costs (N, F - down, F - right) of one step into every cell that it can reach.

    The cells that the step skips count as part of the path. A step's cost is scaled by its length
    in both directions together, so that the length of a path does not depend on its steps.
    """
    count, rows, columns = costs.shape
    cells = max(down, right)
    tolls = np.zeros((count, rows - down, columns - right))
    for cell in range(cells):
        i, j = min(cell, down - 1), min(cell, right - 1)
        tolls += costs[:, down - i : rows - i, right - j : columns - j]
    tolls *= down + right
    tolls /= cells
    return tolls


def _backtrack(choice: Annotated[Indices, "rows columns"]) -> Annotated[Floats, "rows"]:
    """Return the reference phase at every frame by backtracking the chosen steps."""
    row, column = choice.shape[0] - 1, choice.shape[1] - 1
    rows, columns = [row], [column]
    while row > 0:
        down, right = STEP_PATTERN[int(choice[row, column])]
        row, column = row - down, column - right
        rows.append(row)
        columns.append(column)
    path = np.interp(np.arange(choice.shape[0]), rows[::-1], columns[::-1])
    return path / (choice.shape[1] - 1)
