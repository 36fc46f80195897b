"""Random points of a model's controls: `--sample N --method latin --seed S`, or `--method hull`.

Equal seeds give equal points on every machine: only sums, products, sorts and NumPy's guaranteed
random streams are used.
"""

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from posefield.common.errors import InvalidField, did_you_mean
from posefield.common.units import Floats
from posefield.model_file.model_card import ModelCard

BLOCK_SIZE = 4096
"""Points of a block; larger blocks are no faster."""
MAX_POINTS = 10**9
"""Largest number of points; a greater one is considered a typing error."""

ROUNDS = 8
"""Rounds of the Feistel network. Four suffice for large numbers (Luby and Rackoff 1988)."""

Positions = NDArray[np.uint64]


def check_sampling(method: str, count: int, seed: int) -> None:
    """Raise InvalidField for an unknown method, a count out of range or a negative seed."""
    if method not in METHODS:
        hint = did_you_mean(method, METHODS)
        raise InvalidField("method", f"{method!r}{hint}, expected one of {', '.join(METHODS)}")
    if not 1 <= count <= MAX_POINTS:
        raise InvalidField("sample", f"{count}, expected 1 to {MAX_POINTS}")
    if seed < 0:
        raise InvalidField("seed", f"{seed}, expected 0 or more")


def latin_hypercube(card: ModelCard, count: int, seed: int) -> Iterator[Floats]:
    """Yield a Latin hypercube over the sampled ranges, in blocks (n, d).

    Each of `count` equal parts of each control's range contains one point (McKay et al. 1979). A
    discrete control takes its sampled values in equal shares.
    """
    within = [np.random.default_rng((seed, place)) for place in range(len(card.controls))]
    for first, size in _blocks(count):
        points = np.empty((size, len(card.controls)))
        for place, control in enumerate(card.controls):
            rows = np.arange(first, first + size, dtype=np.uint64)
            parts = permute(rows, count, (seed, place, 1))
            jitter = within[place].random(size)
            if control.values:
                chosen = parts.astype(np.int64) * len(control.values) // count
                points[:, place] = np.array(control.values)[chosen]
            else:
                share = (parts + jitter) / count
                points[:, place] = control.minimum + share * (control.maximum - control.minimum)
        yield points


def permute(places: Positions, count: int, seed: tuple[int, ...]) -> Positions:
    """Return the images (n,) of places (n,) under a random permutation of 0 to count - 1.

    Each seed has its own permutation, computed place by place. A Feistel network permutes the
    numbers of an even number of bits; images beyond `count` are permuted again until they are below
    it (Black and Rogaway 2002), fewer than four times on average.
    """
    keys: Positions = np.array(np.random.SeedSequence(seed).generate_state(ROUNDS, np.uint64))
    half = np.uint64(max(1, ((count - 1).bit_length() + 1) // 2))
    images = _feistel_network(places.astype(np.uint64), keys, half)
    beyond = np.flatnonzero(images >= count)
    while len(beyond):
        images[beyond] = _feistel_network(images[beyond], keys, half)
        beyond = beyond[images[beyond] >= count]
    return images


def _feistel_network(numbers: Positions, keys: Positions, half: np.uint64) -> Positions:
    mask = (np.uint64(1) << half) - np.uint64(1)
    left, right = numbers >> half, numbers & mask
    for key in keys:
        left, right = right, left ^ (_scramble(right + key) & mask)
    return (left << half) | right


def _scramble(numbers: Positions) -> Positions:
    """Return numbers scrambled by the finaliser of SplitMix64 (Steele et al. 2014)."""
    numbers = (numbers ^ (numbers >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    numbers = (numbers ^ (numbers >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return numbers ^ (numbers >> np.uint64(31))


def hull_points(card: ModelCard, count: int, seed: int) -> Iterator[Floats]:
    """Yield points in the convex hull of the captured clips' controls, in blocks (n, d).

    Each point is uniform in the simplex of d + 1 random clips, so points are denser where clips
    are. Discrete controls are mixed like continuous ones.
    """
    examples = np.array(card.examples)
    corners = examples.shape[1] + 1
    rng = np.random.default_rng(seed)
    for _, size in _blocks(count):
        numbers = rng.random((size, 2 * corners - 1))
        drawn = (numbers[:, :corners] * len(examples)).astype(np.int64)
        # Gaps between sorted uniform numbers are uniform in the simplex (Devroye 1986, V.2).
        cuts = np.sort(numbers[:, corners:], axis=1)
        weights = np.diff(cuts, axis=1, prepend=0.0, append=1.0)
        # A sum in a fixed order, unlike a matrix product's.
        yield sum(weights[:, k, None] * examples[drawn[:, k]] for k in range(corners))


METHODS: dict[str, Callable[[ModelCard, int, int], Iterator[Floats]]] = {
    "latin": latin_hypercube,
    "hull": hull_points,
}


def _blocks(count: int) -> Iterator[tuple[int, int]]:
    """Yield first row and size of each block."""
    for first in range(0, count, BLOCK_SIZE):
        yield first, min(BLOCK_SIZE, count - first)
