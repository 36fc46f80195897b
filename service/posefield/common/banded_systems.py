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
    found: Floats = bands[0] * values
    for apart in (1, 2):
        band = bands[apart, : max(values.shape[1] - apart, 0)]
        found[:, :-apart] += band * values[:, apart:]
        found[:, apart:] += band * values[:, :-apart]
    return found


def solve(
    bands: Bands, goal: Sides, known: Annotated[Booleans, "size systems"], values: Sides
) -> Sides:
    """Return the solutions (C, U, R) of positive definite systems.

    known: unknowns whose values (C, U, R) are given; their equations are left out.
    """
    given = np.where(known, values, 0.0)
    right = np.where(known, given, goal - product(bands, given))
    own = bands.copy()
    own[0][known] = 1.0
    for apart in (1, 2):
        own[apart][known] = 0.0
        own[apart, : max(len(known) - apart, 0)][known[apart:]] = 0.0
    return np.where(known, given, _solve_free(own, right))


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
    found = np.empty(sides.shape)
    found[:, ::2], found[:, 1::2] = solved
    return found[:, :count].reshape(columns, count, systems)


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
    own, rest = diagonal[:, :, ::2].copy(), sides[:, :, ::2].copy()
    odd = sides[:, :, 1::2]
    own[:, :, :outer] -= _times(down, _turned(before))
    own[:, :, 1 : inner + 1] -= _times(up, after)
    rest[:, :, :outer] -= _times(down, odd)
    rest[:, :, 1 : inner + 1] -= _times(up, odd[:, :, :inner])
    found = np.empty_like(sides)
    found[:, :, ::2] = kept = _reduce(own, -_times(down[:, :, :inner], after), rest)
    left = odd - _times(_turned(before), kept[:, :, :outer])
    left[:, :, :inner] -= _times(after, kept[:, :, 1 : inner + 1])
    found[:, :, 1::2] = _times(inverses, left)
    return found


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
    found = np.empty(blocks.shape)
    found[0, 0], found[0, 1], found[1, 0], found[1, 1] = d, -b, -c, a
    found /= a * d - b * c
    return found
