"""Content of one layer, what builds layers of it, and the shapes on which a template depends."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Protocol, Self

import numpy as np
import numpy.typing as npt

from posefield.common.units import Singles

Array = npt.NDArray[Any]
Samples = Mapping[str, Singles]
"""Samples (F, ...) of attributes at the time codes 0 to F - 1, by name."""

WEIGHTS = "blendShapeWeights"
"""Name of the samples (F, C) of curves; those of other attributes are vectors (F, N, n)."""


class LayerPattern(NamedTuple):
    """Shapes of a content.

    samples: name and shape. values: name, shape and type. facts: whether it has any.
    """

    samples: tuple[tuple[str, tuple[int, ...]], ...]
    values: tuple[tuple[str, tuple[int, ...], str], ...]
    facts: bool


@dataclass(frozen=True)
class LayerContent:
    """Content of a layer: samples of attributes, values by name, and facts.

    No number is -0: it counts as equal to 0, and equal samples are stored once.
    """

    samples: Samples
    values: Mapping[str, Array]
    facts: Mapping[str, Any]

    @property
    def frames(self) -> int:
        """Return the number of samples of each attribute."""
        return len(next(iter(self.samples.values())))

    @property
    def pattern(self) -> LayerPattern:
        """Return the shapes of the content."""
        return LayerPattern(
            tuple((name, rows.shape) for name, rows in self.samples.items()),
            tuple((name, found.shape, found.dtype.char) for name, found in self.values.items()),
            bool(self.facts),
        )


class LayerBuilder(Protocol):
    """Kind of layer; equal kinds build equal layers of equal content."""

    @property
    def rate(self) -> float:
        """Return the frames a second."""

    def with_rate(self, rate: float) -> Self:
        """Return the same kind at other frames a second."""

    def layer(self, content: LayerContent) -> Any:
        """Return the layer, built by usd-core; its prims are valid while the caller holds it."""

    def __hash__(self) -> int: ...


def first_frame(content: LayerContent) -> LayerContent:
    """Return the content with the first sample of each attribute alone."""
    return replace(content, samples={name: rows[:1] for name, rows in content.samples.items()})


def random_content(pattern: LayerPattern, facts: Mapping[str, Any], seed: int) -> LayerContent:
    """Return a content of these shapes with these facts, and values at random that all differ."""
    rng = np.random.default_rng(seed)
    samples = {name: rng.standard_normal(shape, np.float32) for name, shape in pattern.samples}
    values = {n: rng.standard_normal(shape).astype(kind) for n, shape, kind in pattern.values}
    return LayerContent(samples, values, facts)
