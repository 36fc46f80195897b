"""Content of one layer, and the pattern that determines the layout of its bytes.

The binary form of USD stores equal samples and equal numbers once. So the layout depends on which
of them are equal; for layers of equal layout the values are copied into a template.
"""

from collections.abc import Hashable, Mapping
from ctypes import c_float
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from posefield.common.units import Singles
from posefield.encode.usd.custom_data import SplitFacts

Array = npt.NDArray[Any]
Samples = Mapping[str, Singles]
"""Samples (F, ...) of attributes at the time codes 0 to F - 1, by name."""

WEIGHTS = "blendShapeWeights"
"""Name of the samples (F, C) of curves; those of other attributes are vectors (F, N, n)."""

Repeats = tuple[int, ...] | None
"""For each row of samples the index of the first equal row; None if all rows differ."""

PROBED_NUMBERS = 8
"""Count of leading numbers of a sample whose sum is compared before whole samples are."""

BARE, REPEAT = 1500, 36
"""Approximate bytes of a pattern, and of each row of its repeats."""

INLINE = -1
"""Mark of a number that float32 holds exactly: USD stores it inline and does not deduplicate it."""


@dataclass(frozen=True)
class LayerContent:
    """Content of a layer: samples of attributes, values by name, and facts.

    No number is -0, which USD's deduplication does not distinguish from 0.
    """

    samples: Samples
    values: Mapping[str, Array]
    facts: SplitFacts

    @property
    def frames(self) -> int:
        """Return the number of samples of each attribute."""
        return len(next(iter(self.samples.values())))


class LayerBuilder(Protocol):
    """Kind of layer; equal kinds build equal layers of equal content."""

    @property
    def numbers(self) -> tuple[float, ...]:
        """Return the numbers that every layer of this kind holds."""

    @property
    def values(self) -> tuple[Array, ...]:
        """Return the arrays that every layer of this kind holds."""

    def head(self, content: LayerContent) -> Any:
        """Return the layer without its prims."""

    def layer(self, content: LayerContent) -> Any:
        """Return the layer, built by usd-core; its prims are valid while the caller holds it."""

    def __hash__(self) -> int: ...


class LayerPattern(NamedTuple):
    """Properties of a content that determine the layout of its layer's bytes.

    samples: name, shape and repeats. values: name, shape and type. numbers: of each number INLINE,
    or the index of the first equal one among those of the author and those before it. facts: their
    shape. compressed: whether USD compresses some weights.
    """

    samples: tuple[tuple[str, tuple[int, ...], Repeats], ...]
    values: tuple[tuple[str, tuple[int, ...], str], ...]
    numbers: tuple[int, ...]
    facts: Hashable
    compressed: bool = False


def pattern(content: LayerContent, known: tuple[float, ...]) -> LayerPattern:
    """Return the pattern of a content; known: the numbers of its author."""
    return LayerPattern(
        tuple((name, rows.shape, _repeats(rows)) for name, rows in content.samples.items()),
        tuple((name, found.shape, found.dtype.char) for name, found in content.values.items()),
        _first_equal_numbers(content.facts.numbers, known),
        content.facts.shape,
        _is_compressed(content.samples.get(WEIGHTS)),
    )


def samples_size(content: LayerContent) -> int:
    """Return the bytes of the samples of a content."""
    return sum(rows.nbytes for rows in content.samples.values())


def pattern_size(pattern: LayerPattern) -> int:
    """Return the approximate bytes of a pattern in memory."""
    return BARE + REPEAT * sum(len(repeats) for _, _, repeats in pattern.samples if repeats)


def random_content(
    pattern: LayerPattern, known: tuple[float, ...], texts: int, seed: int
) -> LayerContent:
    """Return a content of a pattern with random values, each of which occurs once."""
    rng = np.random.default_rng(seed)
    samples = {}
    for name, shape, repeats in pattern.samples:
        rows = rng.standard_normal(shape, np.float32)
        samples[name] = rows if repeats is None else rows[list(repeats)]
    values = {n: rng.standard_normal(shape).astype(kind) for n, shape, kind in pattern.values}
    numbers: list[float] = []
    for equal in pattern.numbers:
        drawn = rng.standard_normal()
        inline = float(np.float32(drawn))
        numbers.append(inline if equal == INLINE else [*known, *numbers, drawn][equal])
    written = tuple(f"text {seed}.{index}" for index in range(texts))
    return LayerContent(samples, values, SplitFacts(pattern.facts, tuple(numbers), written))


def single_frame_pattern(pattern: LayerPattern) -> LayerPattern:
    """Return the pattern of a layer of a single frame, with numbers that float32 holds."""
    return pattern._replace(
        samples=tuple((name, (1, *shape[1:]), None) for name, shape, _ in pattern.samples),
        numbers=(INLINE,) * len(pattern.numbers),
    )


def _repeats(rows: Singles) -> Repeats:
    """Return the repeats of rows (F, ...).

    Rows are compared by their first numbers, then by sums of a few numbers, and in full only if
    some of these are equal.
    """
    flat = rows.reshape(len(rows), -1)
    if _all_distinct(flat[:, 0]):
        return None
    probes = np.add.reduce(flat[:, :PROBED_NUMBERS], axis=1)
    if _all_distinct(probes):
        return None
    first, sums = dict[Any, int](), probes.tolist()
    alike = [first.setdefault(each, index) for index, each in enumerate(sums)]
    if not np.array_equal(rows, rows[alike]):
        first = {}
        alike = [first.setdefault(row.tobytes(), index) for index, row in enumerate(rows)]
    return tuple(alike) if len(first) < len(rows) else None


LEAST_COMPRESSED, LARGEST_SHARE = 16, 4
"""Size from which USD compresses arrays of floats, and how often on average a number occurs in one
that it compresses (pxr/usd/sdf/crateFile.cpp, `_WritePossiblyCompressedArray`).
"""


def _is_compressed(weights: Singles | None) -> bool:
    """Return whether USD compresses some row of weights (F, C): of whole or of few numbers."""
    if weights is None or weights.shape[1] < LEAST_COMPRESSED:
        return False
    whole = np.all(weights == np.trunc(weights), axis=1)
    ordered = np.sort(weights, axis=1)
    distinct = 1 + np.count_nonzero(ordered[:, 1:] != ordered[:, :-1], axis=1)
    return bool(np.any(whole | (distinct * LARGEST_SHARE <= weights.shape[1])))


def _all_distinct(numbers: Singles) -> bool:
    ordered = np.sort(numbers)
    return not np.count_nonzero(ordered[1:] == ordered[:-1])


def _first_equal_numbers(numbers: tuple[float, ...], known: tuple[float, ...]) -> tuple[int, ...]:
    every = [*known, *numbers]
    return tuple(INLINE if c_float(n).value == n else every.index(n) for n in numbers)


def alike(a: Array, b: Array) -> bool:
    """Return whether two arrays are equal, or any sample of (F, ...) equals the array."""
    if a.ndim == b.ndim:
        return bool(a.item(-2) == b.item(-2)) and np.array_equal(a, b)
    return bool(np.any(np.all(a == b, axis=tuple(range(1, a.ndim)))))
