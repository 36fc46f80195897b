"""What a layer says that others of its kind do not, and what of it shapes the layer's bytes.

In its binary form USD writes once what occurs twice: equal samples, equal numbers. So a layer's
bytes hang on which of them are equal, and for the rest the values are just copied into them.
"""

from collections.abc import Hashable, Mapping
from ctypes import c_float
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from service.encode.facts import Facts
from service.motion.conventions import Singles

Array = npt.NDArray[Any]
Samples = Mapping[str, Singles]
"""By name the samples (F, ...) of an attribute at the time codes 0 to F - 1."""

Repeats = tuple[int, ...] | None
"""Of each row of samples the first that is equal to it; None where no two are."""

PROBED = 8
"""Numbers of a sample by which most are told apart."""

BARE, REPEAT = 1500, 36
"""Bytes that a pattern takes, and each row of its repeats, about."""

INLINE = -1
"""Mark of a number that float32 holds: USD keeps it beside its type, and never looks for others."""


@dataclass(frozen=True)
class Content:
    """Samples of attributes, values by name, and facts.

    No number is -0, which USD takes for 0 where it looks for what is equal.
    """

    samples: Samples
    values: Mapping[str, Array]
    facts: Facts

    @property
    def frames(self) -> int:
        """How many samples each attribute has."""
        return len(next(iter(self.samples.values())))


class Author(Protocol):
    """A kind of layer; kinds that are equal make the same layer of the same content."""

    @property
    def numbers(self) -> tuple[float, ...]:
        """Those that every layer of this kind holds."""

    @property
    def values(self) -> tuple[Array, ...]:
        """Arrays that every layer of this kind holds."""

    def head(self, content: Content) -> Any:
        """The layer without its prims."""

    def layer(self, content: Content) -> Any:
        """The layer, made by usd-core; the caller must keep it, since its prims do not."""

    def __hash__(self) -> int: ...


class Pattern(NamedTuple):
    """How arrays are shaped and which samples are equal, by name, which numbers are, and the
    facts' shape.

    numbers: of each INLINE, or its first equal among those of the author and those before it.
    """

    samples: tuple[tuple[str, tuple[int, ...], Repeats], ...]
    values: tuple[tuple[str, tuple[int, ...], str], ...]
    numbers: tuple[int, ...]
    facts: Hashable


def pattern(content: Content, known: tuple[float, ...]) -> Pattern:
    """Pattern of a content beside the numbers that its author is known to hold."""
    return Pattern(
        tuple((name, rows.shape, _repeats(rows)) for name, rows in content.samples.items()),
        tuple((name, found.shape, found.dtype.char) for name, found in content.values.items()),
        _equals(content.facts.numbers, known),
        content.facts.shape,
    )


def size(pattern: Pattern) -> int:
    """Bytes that it takes, about."""
    return BARE + REPEAT * sum(len(repeats) for _, _, repeats in pattern.samples if repeats)


def marks(pattern: Pattern, known: tuple[float, ...], texts: int, seed: int) -> Content:
    """A content of that pattern in which whatever may differ is random, and occurs once."""
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
    return Content(samples, values, Facts(pattern.facts, tuple(numbers), written))


def short(pattern: Pattern) -> Pattern:
    """Pattern of a layer of a single frame, with numbers that float32 holds."""
    return pattern._replace(
        samples=tuple((name, (1, *shape[1:]), None) for name, shape, _ in pattern.samples),
        numbers=(INLINE,) * len(pattern.numbers),
    )


def _repeats(rows: Singles) -> Repeats:
    """Rows differ whose first numbers do, or the sums of some of them; at others it is looked."""
    flat = rows.reshape(len(rows), -1)
    if _distinct(flat[:, 0]):
        return None
    probes = np.add.reduce(flat[:, :PROBED], axis=1)
    if _distinct(probes):
        return None
    first, sums = dict[Any, int](), probes.tolist()
    alike = [first.setdefault(each, index) for index, each in enumerate(sums)]
    if not np.array_equal(rows, rows[alike]):
        first = {}
        alike = [first.setdefault(row.tobytes(), index) for index, row in enumerate(rows)]
    return tuple(alike) if len(first) < len(rows) else None


def _distinct(numbers: Singles) -> bool:
    ordered = np.sort(numbers)
    return not np.count_nonzero(ordered[1:] == ordered[:-1])


def _equals(numbers: tuple[float, ...], known: tuple[float, ...]) -> tuple[int, ...]:
    every = [*known, *numbers]
    return tuple(INLINE if c_float(n).value == n else every.index(n) for n in numbers)


def alike(a: Array, b: Array) -> bool:
    """Whether two arrays are, or a sample (F, ...) is, equal to another array."""
    if a.ndim == b.ndim:
        return bool(a.item(-2) == b.item(-2)) and np.array_equal(a, b)
    return bool(np.any(np.all(a == b, axis=tuple(range(1, a.ndim)))))
