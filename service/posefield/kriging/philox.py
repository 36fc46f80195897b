"""Counter-based random numbers that are equal on every machine and in every version of NumPy.

NumPy's generators promise no stream across versions (NEP 19). Philox 4x32-10 is integer arithmetic
alone (Salmon, Moraes, Dror, Shaw, "Parallel random numbers: as easy as 1, 2, 3", SC11 2011).
"""

from typing import Annotated

import numpy as np
import numpy.typing as npt

from posefield.common.units import Floats, Indices

Words = Annotated[npt.NDArray[np.uint64], "*seeds words"]
"""Numbers of 32 bits, in 64 so that products keep their upper half."""
Seeds = int | Annotated[Indices, "*seeds"]
"""One seed, or many: numbers of each are the same."""

ROUNDS = 10
MULTIPLIERS = np.uint64(0xD2511F53), np.uint64(0xCD9E8D57)
KEY_STEPS = np.uint64(0x9E3779B9), np.uint64(0xBB67AE85)
WORD_BITS, WORD_MASK = np.uint64(32), np.uint64(0xFFFFFFFF)
BLOCK = 4
"""Words of one counter."""
NORMAL_DECIMALS = 9
"""Decimals of normal numbers: logarithm and cosine differ between machines in the last digits."""


def philox(
    counters: Annotated[npt.NDArray[np.uint64], "4 blocks"],
    key: tuple[npt.ArrayLike, npt.ArrayLike],
) -> Annotated[npt.NDArray[np.uint64], "4 *keys blocks"]:
    """Return the words (4, ..., B) of counters (4, B) by Philox 4x32-10.

    key: two words, or arrays of them (..., 1).
    """
    a, b, c, d = counters
    first, second = (np.asarray(word, np.uint64) for word in key)
    for _ in range(ROUNDS):
        left, right = MULTIPLIERS[0] * a, MULTIPLIERS[1] * c
        a, c = b ^ first, d ^ second
        a ^= right >> WORD_BITS
        c ^= left >> WORD_BITS
        b, d = right & WORD_MASK, left & WORD_MASK
        first, second = (first + KEY_STEPS[0]) & WORD_MASK, (second + KEY_STEPS[1]) & WORD_MASK
    return np.stack([a, b, c, d])


def words(seed: Seeds, stream: int, count: int) -> Words:
    """Return the first words (..., count) of one of the streams of each seed."""
    blocks = -(-count // BLOCK)
    counters = np.zeros((BLOCK, blocks), dtype=np.uint64)
    counters[0], counters[1] = np.arange(blocks, dtype=np.uint64), np.uint64(stream)
    keys = np.asarray(seed, np.uint64)[..., None]
    found = philox(counters, (keys & WORD_MASK, keys >> WORD_BITS))
    return np.moveaxis(found, 0, -1).reshape(*keys.shape[:-1], -1)[..., :count]


def signs(
    seed: Seeds, stream: int, rows: int, columns: int
) -> Annotated[Floats, "*seeds rows columns"]:
    """Return random numbers (..., rows, columns), each 1 or -1, of each seed."""
    bits = words(seed, stream, rows * columns) & np.uint64(1)
    return (2.0 * bits.astype(np.float64) - 1.0).reshape(*np.shape(seed), rows, columns)


def normals(
    seed: Seeds, stream: int, rows: int, columns: int
) -> Annotated[Floats, "*seeds rows columns"]:
    """Return standard normal numbers (..., rows, columns) of one of the streams of each seed.

    By Box and Muller ("A note on the generation of random normal deviates", 1958), rounded.
    """
    pairs, shape = -(-rows * columns // 2), np.shape(seed)
    drawn = words(seed, stream, 2 * pairs).reshape(*shape, pairs, 2)
    shares = (drawn.astype(np.float64) + 0.5) / 2.0**32
    lengths, angles = np.sqrt(-2.0 * np.log(shares[..., 0])), 2.0 * np.pi * shares[..., 1]
    found = np.stack([lengths * np.cos(angles), lengths * np.sin(angles)], axis=-1)
    kept = found.reshape(*shape, -1)[..., : rows * columns]
    return np.round(kept, NORMAL_DECIMALS).reshape(*shape, rows, columns)
