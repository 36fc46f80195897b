"""Templates of binary USD layers: usd-core writes one layer of a pattern, others are filled in.

usd-core takes a millisecond per layer; NumPy copies the values in a twentieth of that. The offsets
are not derived from the file format: a layer with random values is written and searched for them,
and a template is accepted only if its output equals that of usd-core byte for byte. Tokens are
compressed, so usd-core writes them: they are copied from a layer of a single frame.
"""

import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from itertools import combinations
from typing import Any

import numpy as np
import numpy.typing as npt
from pxr import Sdf

from posefield.common.units import Singles
from posefield.encode.usd import crate_sections, custom_data, layer_metadata
from posefield.encode.usd import layer_content as contents
from posefield.encode.usd.crate_sections import CrateParts, CrateSection
from posefield.encode.usd.custom_data import SplitFacts
from posefield.encode.usd.layer_content import (
    INLINE,
    Array,
    LayerBuilder,
    LayerContent,
    LayerPattern,
)

Bytes = npt.NDArray[np.uint8]

# As USD writes a number that float32 holds, and any other.
FLOAT, DOUBLE = struct.Struct("<f"), struct.Struct("<d")


@dataclass(frozen=True)
class SampleRun:
    """Evenly spaced samples in a layer.

    offset: of the first one. stride: bytes between neighbours. rows: their indices.
    """

    offset: int
    stride: int
    rows: slice

    def fill(self, layer: bytearray, rows: Bytes) -> None:
        """Copy samples (F, width) to their offsets in a layer."""
        chosen, strides = rows[self.rows], (self.stride, 1)
        np.ndarray(chosen.shape, np.uint8, layer, self.offset, strides)[:] = chosen


@dataclass(frozen=True)
class CrateTemplate:
    """Bytes of a layer without its tokens, and the offsets of samples, values and numbers.

    numbers: offset, form and index of each number that is stored. short: the pattern of a layer of
    a single frame. apart: pairs of arrays of one size; USD would store equal ones once, so the
    template does not apply to layers in which they are equal.
    """

    values: bytes
    sections: tuple[CrateSection, ...]
    samples: Mapping[str, tuple[SampleRun, ...]]
    places: Mapping[str, int]
    numbers: tuple[tuple[int, struct.Struct, int], ...]
    short: LayerPattern
    known: Mapping[str, Array]
    apart: tuple[tuple[str, str], ...]

    def __len__(self) -> int:
        """Return the approximate bytes of the template in memory."""
        return len(self.values) + sum(len(section.content) for section in self.sections)

    def write(self, author: LayerBuilder, content: LayerContent) -> bytes | None:
        """Return the layer with other content of its pattern.

        None where the result would differ from usd-core's.
        """
        spelt = _token_section(author, self.short, content.facts.texts)
        if spelt is None or self._has_equal_arrays(content):
            return None
        made = bytearray(self.values)
        for name, runs in self.samples.items():
            rows = _row_bytes(content.samples[name])
            for run in runs:
                run.fill(made, rows)
        for name, at in self.places.items():
            value = content.values[name].tobytes()
            made[at : at + len(value)] = value
        for at, form, index in self.numbers:
            form.pack_into(made, at, content.facts.numbers[index])
        return b"".join((made, crate_sections.sections_and_table(made, (spelt, *self.sections))))

    def _has_equal_arrays(self, content: LayerContent) -> bool:
        every = {**content.samples, **content.values, **self.known}
        return any(contents.alike(every[a], every[b]) for a, b in self.apart)


def pattern(author: LayerBuilder, content: LayerContent) -> LayerPattern:
    """Return the pattern that determines the layout of a layer's bytes."""
    return contents.pattern(content, author.numbers)


def ordinary(author: LayerBuilder, content: LayerContent) -> bytes:
    """Return the layer as written by usd-core."""
    return layer_metadata.crate_bytes(author.layer(content))


def template(
    author: LayerBuilder, content: LayerContent, pattern: LayerPattern
) -> CrateTemplate | None:
    """Return a template of an author's layers of one pattern; None if it cannot be verified.

    It is verified if all offsets are found and if usd-core writes the same bytes for the content
    and for random content of the same pattern.
    """
    texts = len(content.facts.texts)
    first, second = (
        contents.random_content(pattern, author.numbers, texts, seed) for seed in (1, 2)
    )
    found = crate_sections.split_crate(ordinary(author, first))
    made = found and _locate_values(author, first, pattern, found)
    if not made:
        return None
    right = all(made.write(author, each) == ordinary(author, each) for each in (content, second))
    return made if right else None


@lru_cache(maxsize=1024)
def _token_section(
    author: LayerBuilder, short: LayerPattern, texts: tuple[str, ...]
) -> CrateSection | None:
    """Return the section of tokens of an author's layers that hold those texts.

    Cached, since usd-core takes half a millisecond. None if the tokens are numbered differently
    than in other layers: a text that equals the name of a prim shares its token.
    """
    found, usual = (
        _single_frame_parts(author, short, texts),
        _reference_parts(author, short, len(texts)),
    )
    return found.sections[0] if found and usual and found.alike(usual) else None


@lru_cache(maxsize=16)
def _reference_parts(author: LayerBuilder, short: LayerPattern, count: int) -> CrateParts | None:
    return _single_frame_parts(author, short, tuple(f"text {index}" for index in range(count)))


def _single_frame_parts(
    author: LayerBuilder, short: LayerPattern, texts: tuple[str, ...]
) -> CrateParts | None:
    said = SplitFacts(short.facts, (0.0,) * len(short.numbers), texts)
    made = Sdf.Layer.CreateAnonymous("words.usda")
    made.TransferContent(_single_frame_layer(author, short, len(texts)))
    layer_metadata.set_custom_data(made, custom_data.usd_dictionary(said.join()))
    return crate_sections.split_crate(layer_metadata.crate_bytes(made))


@lru_cache(maxsize=16)
def _single_frame_layer(author: LayerBuilder, short: LayerPattern, count: int) -> Any:
    """Return a layer of a single frame to copy others from; building it takes twice as long."""
    return author.layer(contents.random_content(short, author.numbers, count, seed=0))


def _locate_values(
    author: LayerBuilder, marks: LayerContent, pattern: LayerPattern, found: CrateParts
) -> CrateTemplate | None:
    values = found.values
    samples = {name: _sample_runs(values, rows) for name, rows in marks.samples.items()}
    places = {name: values.find(value.tobytes()) for name, value in marks.values.items()}
    numbers = tuple(
        (values.find(form.pack(marks.facts.numbers[index])), form, index)
        for form, index in _stored_numbers(pattern, len(author.numbers))
    )
    missing = min((0, *places.values(), *(at for at, _, _ in numbers))) < 0
    if missing or not all(samples.values()):
        return None
    short, known = contents.single_frame_pattern(pattern), _known_arrays(author)
    apart = tuple(_equal_size_pairs(known, marks))
    return CrateTemplate(values, found.sections[1:], samples, places, numbers, short, known, apart)


def _stored_numbers(pattern: LayerPattern, known: int) -> Iterator[tuple[struct.Struct, int]]:
    """Yield form and index of each number that is stored.

    Inline numbers are; of the others, those that equal no earlier one.
    """
    for index, equal in enumerate(pattern.numbers):
        if equal == INLINE:
            yield FLOAT, index
        elif equal == known + index:
            yield DOUBLE, index


def _sample_runs(values: bytes, marks: Singles) -> tuple[SampleRun, ...]:
    """Return runs of evenly spaced samples, equal ones stored once; empty if any is not found."""
    first: dict[bytes, int] = {}
    for index, row in enumerate(marks):
        first.setdefault(row.tobytes(), index)
    places: list[int] = []
    for row in first:
        # Samples are stored in the order of time.
        places.append(values.find(row, places[-1] if places else 0))
    return () if min(places) < 0 else tuple(_even_runs(list(first.values()), places))


def _even_runs(rows: list[int], places: list[int]) -> Iterator[SampleRun]:
    while rows:
        stride = places[1] - places[0] if len(places) > 1 else 0
        steps = zip(np.diff(rows).tolist(), np.diff(places).tolist(), strict=True)
        uneven = (index for index, step in enumerate(steps, 1) if step != (1, stride))
        count = next(uneven, len(rows))
        yield SampleRun(places[0], stride, slice(rows[0], rows[0] + count))
        rows, places = rows[count:], places[count:]


def _known_arrays(author: LayerBuilder) -> dict[str, Array]:
    return {f"known {index}": value for index, value in enumerate(author.values)}


def _equal_size_pairs(known: Mapping[str, Array], marks: LayerContent) -> Iterator[tuple[str, str]]:
    """Yield pairs of arrays, or of samples and an array, that have one size."""
    every = {**marks.samples, **marks.values, **known}
    of_one = {n: v.shape[1:] if n in marks.samples else v.shape for n, v in every.items()}
    for a, b in combinations(every, 2):
        if of_one[a] == of_one[b]:
            yield a, b


def _row_bytes(samples: Singles) -> Bytes:
    return np.ascontiguousarray(samples).view(np.uint8).reshape(len(samples), -1)
