"""Solution of long symmetric systems of five diagonals, in time and memory that grow linearly.

Block cyclic reduction: two unknowns are one block, of which every second one is eliminated at a
time. All eliminations of a round are one product of arrays, so a system of a minute of motion is
solved in a few milliseconds, and its sums go in the same order on all machines.
"""

from typing import Annotated, Any

import numpy as np
import numpy.typing as npt

from posefield.common.units import Booleans, Floats

Numbers = npt.NDArray[Any]
Bands = Annotated[Floats, "3 size"]
"""Diagonal of a symmetric matrix (U, U), and the two above it, by row; zeros beyond its end."""

Blocks = Annotated[Floats, "_ 2 2"]
Sides = Annotated[Floats, "_ 2 columns"]


def product(bands: Bands, values: Annotated[Numbers, "size"]) -> Annotated[Numbers, "size"]:
    """Return the product (U,) of the matrix and a vector (U,)."""
    found: Numbers = bands[0] * values
    for apart in (1, 2):
        band = bands[apart, : max(len(values) - apart, 0)]
        found[:-apart] += band * values[apart:]
        found[apart:] += band * values[:-apart]
    return found


def solve(
    bands: Bands,
    goal: Annotated[Numbers, "size"],
    known: Annotated[Booleans, "size"],
    values: Annotated[Numbers, "size"],
) -> Annotated[Numbers, "size"]:
    """Return the solution (U,), real or complex, of a positive definite system.

    known: unknowns whose values (U,) are given; their equations are left out.
    """
    given = np.where(known, values, 0.0)
    right = np.where(known, given, goal - product(bands, given))
    own = bands.copy()
    own[0, known] = 1.0
    for apart in (1, 2):
        own[apart, known] = 0.0
        own[apart, : max(len(known) - apart, 0)][known[apart:]] = 0.0
    columns = (
        np.stack([right.real, right.imag], axis=1) if np.iscomplexobj(right) else right[:, None]
    )
    found = _solve_columns(own, columns)
    whole = found[:, 0] + 1j * found[:, 1] if np.iscomplexobj(right) else found[:, 0]
    exact: Numbers = np.where(known, given, whole)
    return exact


def _solve_columns(bands: Bands, right: Floats) -> Floats:
    """Return the solutions (U, C) for right sides (U, C)."""
    count, odd = len(right), len(right) % 2
    # One more unknown makes whole blocks; it is zero.
    wide = np.pad(bands, ((0, 0), (0, odd)))
    wide[0, count:] = 1.0
    diagonal = np.empty((wide.shape[1] // 2, 2, 2))
    diagonal[:, 0, 0], diagonal[:, 1, 1] = wide[0, ::2], wide[0, 1::2]
    diagonal[:, 0, 1] = diagonal[:, 1, 0] = wide[1, ::2]
    above = np.zeros_like(diagonal)
    above[:, 0, 0], above[:, 1, 1], above[:, 1, 0] = wide[2, ::2], wide[2, 1::2], wide[1, 1::2]
    sides = np.pad(right, ((0, odd), (0, 0))).reshape(len(diagonal), 2, -1)
    return _reduce(diagonal, above, sides).reshape(-1, right.shape[1])[:count]


def _reduce(diagonal: Blocks, above: Blocks, sides: Sides) -> Sides:
    """Return the solution (B, 2, C) of a system of blocks on the diagonal, and right above it."""
    count = len(diagonal)
    if count == 1:
        return _inverses(diagonal) @ sides
    # Blocks 1, 3, ... are eliminated: each lies after a block that is kept, and before one unless
    # it is the last.
    inverses = _inverses(diagonal[1::2])
    inner = (count - 1) // 2
    before, after = above[: count - 1 : 2], above[1 : count - 1 : 2]
    down = before @ inverses
    up = np.swapaxes(after, 1, 2) @ inverses[:inner]
    own, rest = diagonal[::2].copy(), sides[::2].copy()
    own[: len(down)] -= down @ np.swapaxes(before, 1, 2)
    own[1 : inner + 1] -= up @ after
    rest[: len(down)] -= down @ sides[1::2]
    rest[1 : inner + 1] -= up @ sides[1::2][:inner]
    found = np.empty_like(sides)
    found[::2] = kept = _reduce(own, -down[:inner] @ after, rest)
    left = sides[1::2] - np.swapaxes(before, 1, 2) @ kept[: len(down)]
    left[:inner] -= after @ kept[1 : inner + 1]
    found[1::2] = inverses @ left
    return found


def _inverses(blocks: Blocks) -> Blocks:
    """Return the inverses (B, 2, 2)."""
    a, b, c, d = blocks[:, 0, 0], blocks[:, 0, 1], blocks[:, 1, 0], blocks[:, 1, 1]
    found = np.empty_like(blocks)
    found[:, 0, 0], found[:, 0, 1], found[:, 1, 0], found[:, 1, 1] = d, -b, -c, a
    return found / (a * d - b * c)[:, None, None]
