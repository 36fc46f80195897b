"""Counter-based random numbers that are equal on every machine and in every version of NumPy.

NumPy's generators promise no stream across versions (NEP 19). Philox 4x32-10 is integer arithmetic
alone (Salmon, Moraes, Dror, Shaw, "Parallel random numbers: as easy as 1, 2, 3", SC11 2011).
"""

from typing import Annotated

import numpy as np
import numpy.typing as npt

from posefield.common.units import Floats

Words = Annotated[npt.NDArray[np.uint64], "words"]
"""Numbers of 32 bits, in 64 so that products keep their upper half."""

ROUNDS = 10
MULTIPLIERS = np.uint64(0xD2511F53), np.uint64(0xCD9E8D57)
KEY_STEPS = 0x9E3779B9, 0xBB67AE85
WORD_BITS, WORD_MASK = np.uint64(32), np.uint64(0xFFFFFFFF)
BLOCK = 4
"""Words of one counter."""
NORMAL_DECIMALS = 9
"""Decimals of normal numbers: logarithm and cosine differ between machines in the last digits."""


def philox(
    counters: Annotated[npt.NDArray[np.uint64], "4 blocks"], key: tuple[int, int]
) -> Annotated[npt.NDArray[np.uint64], "4 blocks"]:
    """Return the words (4, B) of counters (4, B) by Philox 4x32-10."""
    a, b, c, d = counters
    first, second = key
    for _ in range(ROUNDS):
        left, right = MULTIPLIERS[0] * a, MULTIPLIERS[1] * c
        a, c = b ^ np.uint64(first), d ^ np.uint64(second)
        a ^= right >> WORD_BITS
        c ^= left >> WORD_BITS
        b, d = right & WORD_MASK, left & WORD_MASK
        first = (first + KEY_STEPS[0]) & 0xFFFFFFFF
        second = (second + KEY_STEPS[1]) & 0xFFFFFFFF
    return np.stack([a, b, c, d])


def words(seed: int, stream: int, count: int) -> Words:
    """Return the first words (count,) of one of a seed's streams."""
    blocks = -(-count // BLOCK)
    counters = np.zeros((BLOCK, blocks), dtype=np.uint64)
    counters[0], counters[1] = np.arange(blocks, dtype=np.uint64), np.uint64(stream)
    found = philox(counters, (seed & 0xFFFFFFFF, seed >> 32))
    return found.T.reshape(-1)[:count]


def signs(seed: int, stream: int, rows: int, columns: int) -> Annotated[Floats, "rows columns"]:
    """Return random numbers (rows, columns), each 1 or -1."""
    bits = words(seed, stream, rows * columns) & np.uint64(1)
    return (2.0 * bits.astype(np.float64) - 1.0).reshape(rows, columns)


def normals(seed: int, stream: int, rows: int, columns: int) -> Annotated[Floats, "rows columns"]:
    """Return standard normal numbers (rows, columns) of one of a seed's streams.

    By Box and Muller ("A note on the generation of random normal deviates", 1958), rounded.
    """
    pairs = -(-rows * columns // 2)
    drawn = words(seed, stream, 2 * pairs).reshape(-1, 2)
    shares = (drawn.astype(np.float64) + 0.5) / 2.0**32
    lengths, angles = np.sqrt(-2.0 * np.log(shares[:, 0])), 2.0 * np.pi * shares[:, 1]
    found = np.stack([lengths * np.cos(angles), lengths * np.sin(angles)], axis=1)
    return np.round(found.reshape(-1)[: rows * columns], NORMAL_DECIMALS).reshape(rows, columns)
