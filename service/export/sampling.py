"""Queries at points drawn at random: `--sample N --method latin|hull --seed S`.

Equal seeds give equal points, whatever the machine: only sums, products, sorts and what NumPy
promises never to change are used.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from service.export import permutation
from service.export.blocks import SIZE, Block
from service.export.columns import Column
from service.motion.card import Control, ModelCard
from service.motion.conventions import Floats
from service.motion.errors import InvalidField

MOST = 10**9
"""Points that can be drawn: more is a slip of the keyboard."""


@dataclass(frozen=True)
class Drawn:
    """Points drawn from a model's controls. method: a key of METHODS."""

    columns: tuple[Column, ...]
    card: ModelCard
    method: str
    count: int
    seed: int

    def place(self, point: int) -> str:
        """How a point is named in messages."""
        return f"sample {point}"

    def spec(self) -> dict[str, Any]:
        """All that the points hang on but the model, as plain values."""
        return {"method": self.method, "count": self.count, "seed": self.seed}

    def blocks(self) -> Iterator[Block]:
        """Points from the first on."""
        readers = [column.kind.values for column in self.columns]
        first = 0
        for points in METHODS[self.method](self.card, self.count, self.seed):
            numbers = range(first + 1, first + 1 + len(points))
            yield Block(first, numbers, self.columns, readers, points.T.tolist())
            first += len(points)


def check(method: str, count: int, seed: int) -> None:
    """InvalidField for what nothing can be drawn by."""
    if method not in METHODS:
        raise InvalidField("method", f"{method!r}, expected one of {', '.join(METHODS)}")
    if not 1 <= count <= MOST:
        raise InvalidField("sample", f"{count}, expected 1 to {MOST}")
    if seed < 0:
        raise InvalidField("seed", f"{seed}, expected 0 or more")


def latin(card: ModelCard, count: int, seed: int) -> Iterator[Floats]:
    """Latin hypercube over the sampled ranges, in blocks (n, d).

    Of `count` equal parts of each control's range every one holds one point (McKay et al. 1979). A
    control of which few values were sampled takes those, in equal shares.
    """
    within = [np.random.default_rng((seed, place)) for place in range(len(card.controls))]
    for first, size in _blocks(count):
        points = np.empty((size, len(card.controls)))
        for place, control in enumerate(card.controls):
            rows = np.arange(first, first + size, dtype=np.uint64)
            parts = permutation.of(rows, count, (seed, place, 1))
            jitter = within[place].random(size)
            points[:, place] = _spread(control, parts, jitter, count)
        yield points


def _spread(control: Control, parts: permutation.Places, jitter: Floats, count: int) -> Floats:
    """Values (n,) of a control in parts (n,) of `count`; jitter (n,), where in each part."""
    if control.values:
        return np.array(control.values)[parts.astype(np.int64) * len(control.values) // count]
    share = (parts + jitter) / count
    return control.minimum + share * (control.maximum - control.minimum)


def hull(card: ModelCard, count: int, seed: int) -> Iterator[Floats]:
    """Points in the convex hull of the captured clips' controls, in blocks (n, d).

    Each is even in the simplex of d + 1 clips drawn at random: denser where clips are, and never
    among controls that no clip was near to. Controls of few values are mixed like any other.
    """
    examples = np.array(card.examples)
    corners = examples.shape[1] + 1
    rng = np.random.default_rng(seed)
    for _, size in _blocks(count):
        numbers = rng.random((size, 2 * corners - 1))
        drawn = (numbers[:, :corners] * len(examples)).astype(np.int64)
        # Gaps between sorted numbers are even in the simplex (Devroye 1986, V.2).
        cuts = np.sort(numbers[:, corners:], axis=1)
        weights = np.diff(cuts, axis=1, prepend=0.0, append=1.0)
        # A sum in a fixed order, unlike a matrix product's.
        yield sum(weights[:, k, None] * examples[drawn[:, k]] for k in range(corners))


METHODS: dict[str, Callable[[ModelCard, int, int], Iterator[Floats]]] = {
    "latin": latin,
    "hull": hull,
}


def _blocks(count: int) -> Iterator[tuple[int, int]]:
    """First row and size of each block."""
    for first in range(0, count, SIZE):
        yield first, min(SIZE, count - first)
