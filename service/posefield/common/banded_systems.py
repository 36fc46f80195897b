"""Solution of many symmetric systems of five diagonals, in time and memory that grow linearly.

Block cyclic reduction: two unknowns are one block, of which every second one is eliminated at a
time. All eliminations of a round, of all systems, are a few products of arrays, so a system of a
minute of motion is solved in a few milliseconds. No sum is a matrix product: a system has the same
bytes alone and among others, and on all machines.
"""

from typing import Annotated

import numpy as np

from posefield.common.units import Booleans, Floats

Bands = Annotated[Floats, "3 size systems"]
"""Diagonals of R symmetric matrices (U, U), and the two above each, by row; zeros beyond its end.
Systems that are smaller end with ones on the diagonal."""

Sides = Annotated[Floats, "columns size systems"]
"""Right sides, or solutions, (C, U, R): C for each of R systems."""

Blocks = Annotated[Floats, "2 2 blocks systems"]
BlockSides = Annotated[Floats, "2 columns blocks systems"]


def product(bands: Bands, values: Sides) -> Sides:
    """Return the products (C, U, R) of the matrices and vectors (C, U, R)."""
    products: Floats = bands[0] * values
    for offset in (1, 2):
        band = bands[offset, : max(values.shape[1] - offset, 0)]
        products[:, :-offset] += band * values[:, offset:]
        products[:, offset:] += band * values[:, :-offset]
    return products


def solve(
    bands: Bands, goal: Sides, fixed: Annotated[Booleans, "size systems"], values: Sides
) -> Sides:
    """Return the solutions (C, U, R) of positive definite systems.

    known: unknowns whose values (C, U, R) are given; their equations are left out.
    """
    fixed_values = np.where(fixed, values, 0.0)
    right = np.where(fixed, fixed_values, goal - product(bands, fixed_values))
    reduced = bands.copy()
    reduced[0][fixed] = 1.0
    for offset in (1, 2):
        reduced[offset][fixed] = 0.0
        reduced[offset, : max(len(fixed) - offset, 0)][fixed[offset:]] = 0.0
    return np.where(fixed, fixed_values, _solve_free(reduced, right))


def _solve_free(bands: Bands, right: Sides) -> Sides:
    """Return the solutions (C, U, R) for right sides (C, U, R)."""
    columns, count, systems = right.shape
    odd = count % 2
    # One more unknown makes whole blocks; it is zero.
    wide = np.pad(bands, ((0, 0), (0, odd), (0, 0)))
    wide[0, count:] = 1.0
    diagonal, above = np.zeros((2, 2, 2, (count + odd) // 2, systems))
    diagonal[0, 0], diagonal[1, 1] = wide[0, ::2], wide[0, 1::2]
    diagonal[0, 1] = diagonal[1, 0] = wide[1, ::2]
    above[0, 0], above[1, 1], above[1, 0] = wide[2, ::2], wide[2, 1::2], wide[1, 1::2]
    sides = np.pad(right, ((0, 0), (0, odd), (0, 0)))
    blocks = np.stack([sides[:, ::2], sides[:, 1::2]])
    solved = _reduce(diagonal, above, blocks)
    solution = np.empty(sides.shape)
    solution[:, ::2], solution[:, 1::2] = solved
    return solution[:, :count].reshape(columns, count, systems)


def _reduce(
    diagonal: Blocks, above: Annotated[Floats, "2 2 _ systems"], sides: BlockSides
) -> BlockSides:
    """Return the solution (2, C, B, R) of systems of blocks on the diagonal, and right above it."""
    count = diagonal.shape[2]
    if count == 1:
        return _times(_inverses(diagonal), sides)
    # Blocks 1, 3, ... are eliminated: each lies after a block that is kept, and before one unless
    # it is the last.
    inverses = _inverses(diagonal[:, :, 1::2])
    inner, outer = (count - 1) // 2, count // 2
    before, after = above[:, :, : count - 1 : 2], above[:, :, 1 : count - 1 : 2]
    down, up = _times(before, inverses), _times(_turned(after), inverses[:, :, :inner])
    even_blocks, rest = diagonal[:, :, ::2].copy(), sides[:, :, ::2].copy()
    odd = sides[:, :, 1::2]
    even_blocks[:, :, :outer] -= _times(down, _turned(before))
    even_blocks[:, :, 1 : inner + 1] -= _times(up, after)
    rest[:, :, :outer] -= _times(down, odd)
    rest[:, :, 1 : inner + 1] -= _times(up, odd[:, :, :inner])
    solution = np.empty_like(sides)
    solution[:, :, ::2] = even = _reduce(even_blocks, -_times(down[:, :, :inner], after), rest)
    left = odd - _times(_turned(before), even[:, :, :outer])
    left[:, :, :inner] -= _times(after, even[:, :, 1 : inner + 1])
    solution[:, :, 1::2] = _times(inverses, left)
    return solution


def _times(
    a: Blocks, b: Annotated[Floats, "2 columns blocks systems"]
) -> Annotated[Floats, "2 columns blocks systems"]:
    """Return the products of blocks and blocks, or of blocks and right sides."""
    return a[:, 0, None] * b[None, 0] + a[:, 1, None] * b[None, 1]


def _turned(blocks: Blocks) -> Blocks:
    """Return the transposed blocks."""
    return blocks.swapaxes(0, 1)


def _inverses(blocks: Blocks) -> Blocks:
    """Return the inverses of blocks."""
    (a, b), (c, d) = blocks
    inverses = np.empty(blocks.shape)
    inverses[0, 0], inverses[0, 1], inverses[1, 0], inverses[1, 1] = d, -b, -c, a
    inverses /= a * d - b * c
    return inverses
