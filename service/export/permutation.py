"""Random permutations that are computed where they are asked for, and never held."""

import numpy as np
from numpy.typing import NDArray

ROUNDS = 8
"""Of a Feistel network: four look random (Luby and Rackoff 1988); a few more for few bits."""

Places = NDArray[np.uint64]


def of(places: Places, count: int, seed: tuple[int, ...]) -> Places:
    """Where a permutation of 0 to count - 1, one for each seed, sends places (n,).

    A Feistel network permutes the numbers of an even count of bits; who lands beyond `count` walks
    on until he is back (Black and Rogaway 2002), after fewer than four steps on average.
    """
    keys: Places = np.array(np.random.SeedSequence(seed).generate_state(ROUNDS, np.uint64))
    half = np.uint64(max(1, ((count - 1).bit_length() + 1) // 2))
    sent = _network(places.astype(np.uint64), keys, half)
    beyond = np.flatnonzero(sent >= count)
    while len(beyond):
        sent[beyond] = _network(sent[beyond], keys, half)
        beyond = beyond[sent[beyond] >= count]
    return sent


def _network(numbers: Places, keys: Places, half: np.uint64) -> Places:
    mask = (np.uint64(1) << half) - np.uint64(1)
    left, right = numbers >> half, numbers & mask
    for key in keys:
        left, right = right, left ^ (_scatter(right + key) & mask)
    return (left << half) | right


def _scatter(numbers: Places) -> Places:
    """Numbers without a pattern, by the finaliser of SplitMix64 (Steele et al. 2014)."""
    numbers = (numbers ^ (numbers >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    numbers = (numbers ^ (numbers >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return numbers ^ (numbers >> np.uint64(31))
