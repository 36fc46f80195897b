"""Binary USD layers by templates: usd-core writes one layer of a kind, others are filled in.

usd-core takes a millisecond and more per layer, NumPy a tenth of that. Places of values are not
derived from the file format: a layer with marks, which usd-core wrote, is searched for them. Behind
its values come time samples and facts, of any number. A template is accepted only if usd-core reads
a filled layer as one that it would write itself; otherwise usd-core writes all layers of that kind.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, NamedTuple, Self

import numpy as np
import numpy.typing as npt

from posefield.encode import crate_sections, layers
from posefield.encode.character import Convention
from posefield.encode.crate_sections import (
    DOUBLE,
    MARK,
    CrateSection,
    FactPlace,
    SamplesPlace,
)
from posefield.encode.layers import Samples

Array = npt.NDArray[Any]


class LayerPattern(NamedTuple):
    """Shapes of a content.

    samples: name and shape. values: name, shape and type. facts: whether it has any.
    """

    samples: tuple[tuple[str, tuple[int, ...]], ...]
    values: tuple[tuple[str, tuple[int, ...], str], ...]
    facts: bool


class LayerContent(NamedTuple):
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
        """Return the shapes of the content with one sample of each attribute."""
        return LayerPattern(
            tuple((name, (1, *rows.shape[1:])) for name, rows in self.samples.items()),
            tuple((name, array.shape, array.dtype.char) for name, array in self.values.items()),
            bool(self.facts),
        )


@dataclass(frozen=True)
class LayerBuilder(ABC):
    """Layers of one kind, rate and convention; equal builders build equal layers of a content."""

    rate: float
    convention: Convention

    def with_rate(self, rate: float) -> Self:
        """Return layers of another rate."""
        return replace(self, rate=rate)

    @abstractmethod
    def layer(self, content: LayerContent) -> Any:
        """Return the layer, built by usd-core; its prims are valid while the caller holds it."""

    def set_metadata(self, layer: Any, default: str, content: LayerContent) -> None:
        """Set the metadata of a layer, with this default prim, and the facts of its content."""
        layers.set_layer_metadata(layer, default, content.frames, self.rate, self.convention)
        layers.set_custom_data(layer, content.facts)


def random_content(pattern: LayerPattern, facts: Mapping[str, Any], seed: int) -> LayerContent:
    """Return a content of these shapes with these facts, and values at random that all differ."""
    rng = np.random.default_rng(seed)
    samples = {name: rng.standard_normal(shape, np.float32) for name, shape in pattern.samples}
    values = {n: rng.standard_normal(shape).astype(kind) for n, shape, kind in pattern.values}
    return LayerContent(samples, values, facts)


MARKED_RATE, MARKED_END = 1.2345678901234567e-301, 1.2345678901234567e-302
"""Rate and last time code of the layer with marks; float32 holds neither."""
MAX_TEMPLATES = 64
"""Number of templates in memory; most take less than 100 kB."""
TRIAL_RATE, TRIAL_FRAMES = 29.97, 3
TRIAL_FACTS = {"number": 0.1, "half": 0.5, "text": "ada", "list": [0.1, 0.2], "of": [{"at": "a"}]}
"""Frames a second, distinct frames and facts of the layers by which templates are verified."""


@dataclass(frozen=True)
class CrateTemplate:
    """A layer with marks, and the places of samples, values, facts and times.

    head: the layer's head and values. facts: None for layers without.
    """

    head: bytes
    sections: tuple[CrateSection, ...]
    rate: int
    end: int
    samples: Mapping[str, SamplesPlace]
    values: Mapping[str, int]
    facts: FactPlace | None

    def write(self, rate: float, content: LayerContent) -> bytes:
        """Return the layer of a content, at so many frames a second."""
        data = bytearray(self.head)
        DOUBLE.pack_into(data, self.rate, rate)
        DOUBLE.pack_into(data, self.end, content.frames - 1)
        for name, at in self.values.items():
            value = content.values[name].tobytes()
            data[at : at + len(value)] = value
        times = crate_sections.add_times(data, content.frames)
        for name, samples_place in self.samples.items():
            samples_place.add(data, times, content.samples[name])
        sections = self.sections
        if self.facts is not None:
            tables = self.facts.add(data, content.facts)
            sections = (*tables, *sections[len(tables) :])
        return crate_sections.join_crate(data, sections)


def usdc(builder: LayerBuilder, content: LayerContent) -> bytes:
    """Return a binary layer; equal builders and contents have equal bytes."""
    # Layers of all rates and lengths have one template.
    filled = template(builder.with_rate(MARKED_RATE), content.pattern)
    if filled is None:
        return layers.crate_bytes(builder.layer(content))
    return filled.write(builder.rate, content)


@lru_cache(maxsize=MAX_TEMPLATES)
def template(builder: LayerBuilder, pattern: LayerPattern) -> CrateTemplate | None:
    """Return the template of a builder's layers of one pattern; None if it cannot be verified.

    builder: of the marked rate. pattern: of a single frame.
    """
    marks = random_content(pattern, {}, seed=1)
    layer = builder.layer(marks)
    layer.endTimeCode = MARKED_END
    if pattern.facts:
        layer.customLayerData = {layers.FACTS: MARK}
    crate = crate_sections.split_crate(layers.crate_bytes(layer))
    candidate = crate and _located(*crate, marks, pattern.facts)
    verified = candidate and _is_verified(candidate, builder.with_rate(TRIAL_RATE), pattern)
    return candidate if verified else None


def _is_verified(candidate: CrateTemplate, builder: LayerBuilder, pattern: LayerPattern) -> bool:
    """Return whether usd-core reads filled layers as those that it builds itself."""
    facts = TRIAL_FACTS if pattern.facts else {}
    single_frame = random_content(pattern, facts, seed=2)
    rows = [0, *range(TRIAL_FRAMES), 0]
    random_rows = {
        name: np.random.default_rng(3).standard_normal((TRIAL_FRAMES, *shape[1:]), np.float32)[rows]
        for name, shape in pattern.samples
    }
    return all(
        layers.crate_text(candidate.write(builder.rate, content))
        == builder.layer(content).ExportToString()
        for content in (single_frame, single_frame._replace(samples=random_rows))
    )


def _located(
    values: bytes, sections: tuple[CrateSection, ...], marks: LayerContent, facts: bool
) -> CrateTemplate | None:
    rate, end = (values.find(DOUBLE.pack(mark)) for mark in (MARKED_RATE, MARKED_END))
    offsets = {name: values.find(value.tobytes()) for name, value in marks.values.items()}
    samples = {n: crate_sections.find_samples(values, row) for n, row in marks.samples.items()}
    fact_place = crate_sections.find_facts(values, sections) if facts else None
    if min(rate, end, *offsets.values()) < 0 or (facts and fact_place is None):
        return None
    located = {name: place for name, place in samples.items() if place is not None}
    if len(located) < len(samples):
        return None
    return CrateTemplate(values, sections, rate, end, located, offsets, fact_place)
