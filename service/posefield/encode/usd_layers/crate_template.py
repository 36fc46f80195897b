"""Binary USD layers by templates: usd-core writes one layer of a kind, others are filled in.

usd-core takes a millisecond and more per layer, NumPy a tenth of that. Places of values are not
derived from the file format: a layer with marks, which usd-core wrote, is searched for them. Behind
its values come time samples and facts, of any number. A template is accepted only if usd-core reads
a filled layer as one that it would write itself; otherwise usd-core writes all layers of that kind.

Facts differ from clip to clip in how many there are and in their texts, so usd-core would lay out
each layer in another way and no template would fit. Therefore usd-core writes a mark in their
place. The offset beside the mark then leads to a dictionary behind all other values, as the format
allows (pxr/usd/sdf/crateFile.cpp, `_RecursiveWrite`), and the texts are appended to the tables of
tokens and strings. Equal numbers and texts of other parts of the layer are not shared.
"""

import struct
from collections.abc import Mapping
from ctypes import c_float
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

from posefield.encode.usd_layers import crate_sections, layers
from posefield.encode.usd_layers.crate_sections import (
    ALIGNMENT,
    ARRAY,
    COUNT,
    DOUBLE,
    FLOAT,
    INDEX,
    INLINED,
    JUMP,
    LONG_INTEGER,
    TYPES,
    CrateParts,
    CrateSection,
    SamplesPlace,
)
from posefield.encode.usd_layers.layers import FactList, LayerBuilder, LayerContent, LayerPattern

MARK = 1.2345678901234567e-300
"""The number that usd-core writes in place of the facts; float32 does not hold it."""

INLINE_FACT, FLOAT_FACT = struct.Struct("<IqQ"), struct.Struct("<IqdQ")
"""Index of a name, an offset to a description, and this; in between a number."""
TOKENS_HEAD = struct.Struct("<QQQ")
"""Number of tokens, bytes of their texts, and bytes of these when compressed."""
MARKED = JUMP.pack(JUMP.size + DOUBLE.size) + DOUBLE.pack(MARK)
"""The mark in a layer: the offset of its description, from here, and its value."""
TEXT, NUMBER = TYPES[str] | INLINED, TYPES[float] | INLINED
PLAIN = frozenset((str, float, bool, dict))
"""Types of facts that are written as they are."""
ELEMENTS = {str: (TYPES[str], "I"), int: (LONG_INTEGER, "q"), float: (TYPES[float], "d")}
"""Type of a list's elements, and their form in `struct`."""


@dataclass(frozen=True)
class FactPlace:
    """The place of the facts in a layer, and its tables of texts.

    jump: position of the offset that leads to the facts. tokens: their number. text_bytes: bytes of
    their texts. sequences, literals: the compressed texts, without and as their last run. strings:
    the table, an index of a token each.
    """

    jump: int
    tokens: int
    text_bytes: int
    sequences: bytes
    literals: bytes
    strings: bytes

    def add(self, values: bytearray, facts: Mapping[str, Any]) -> tuple[CrateSection, CrateSection]:
        """Append facts to values; return the sections of tokens and of strings.

        Raises ValueError for a text with the character NUL, which ends a token.
        """
        writer = _FactWriter(values, {}, len(self.strings) // INDEX.size)
        description = writer.dictionary(facts)
        JUMP.pack_into(values, self.jump, len(values) - self.jump)
        values += COUNT.pack(description)
        return self._tables(list(writer.texts))

    def _tables(self, texts: list[str]) -> tuple[CrateSection, CrateSection]:
        if any("\0" in text for text in texts):
            raise ValueError("a fact with the character NUL, expected text without it")
        more = "".join(f"{text}\0" for text in texts).encode()
        literals = self.literals + more
        packed = self.sequences + _literal_run(len(literals)) + literals
        head = self.tokens + len(texts), self.text_bytes + len(more), len(packed)
        indices = range(self.tokens, self.tokens + len(texts))
        strings = self.strings + struct.pack(f"<{len(texts)}I", *indices)
        return (
            CrateSection(b"TOKENS", TOKENS_HEAD.pack(*head) + packed),
            CrateSection(b"STRINGS", COUNT.pack(len(strings) // INDEX.size) + strings),
        )


def find_place(crate: CrateParts) -> FactPlace | None:
    """Return the place of the facts in a layer with a mark; None for another layout."""
    jump = crate.values.find(MARKED)
    if jump < 0 or [section.name for section in crate.sections[:2]] != [b"TOKENS", b"STRINGS"]:
        return None
    tokens, strings = (section.content for section in crate.sections[:2])
    count, text_bytes, size = TOKENS_HEAD.unpack_from(tokens)
    packed = tokens[TOKENS_HEAD.size :]
    # The first byte counts further parts of a text of gigabytes.
    if len(packed) != size or packed[0] != 0:
        return None
    start, length = _last_run(packed)
    literals = packed[len(packed) - length :]
    return FactPlace(jump, count, text_bytes, packed[:start], literals, strings[COUNT.size :])


@dataclass
class _FactWriter:
    """Writer of facts behind values.

    texts: index in the table of strings, of which the layer has `before`.
    """

    values: bytearray
    texts: dict[str, int]
    before: int

    def dictionary(self, facts: Mapping[str, Any]) -> int:
        """Return the description of facts, which are written.

        For each there is its name, an offset, a value unless the description holds it, and this.
        """
        names = sorted([name for name, fact in facts.items() if fact is not None])
        description = self._append(COUNT.pack(len(names)))
        for name in names:
            fact, index = facts[name], self._string(name)
            if type(fact) not in PLAIN:
                fact = layers.plain_fact(fact)
            if type(fact) is str:
                self.values += INLINE_FACT.pack(index, JUMP.size, TEXT | self._string(fact))
            elif type(fact) is float:
                self.values += _float_fact(index, fact, len(self.values))
            else:
                self._fact(index, fact)
        return TYPES[dict] | description

    def _fact(self, index: int, fact: Any) -> None:
        """Write a fact of any length, by the index of its name."""
        jump = self._append(INDEX.pack(index) + bytes(JUMP.size)) + INDEX.size
        described = self._describe(fact)
        JUMP.pack_into(self.values, jump, len(self.values) - jump)
        self.values += COUNT.pack(described)

    def _describe(self, fact: dict[str, Any] | FactList | bool | int) -> int:
        if isinstance(fact, dict):
            return self.dictionary(fact)
        if isinstance(fact, FactList):
            return self._list(fact)
        return TYPES[bool] | INLINED | fact if isinstance(fact, bool) else self._integer(fact)

    def _integer(self, fact: int) -> int:
        if -(1 << 31) <= fact < 1 << 31:
            return TYPES[int] | INLINED | fact & 0xFFFFFFFF
        return LONG_INTEGER | self._append(JUMP.pack(fact))

    def _list(self, fact: FactList) -> int:
        kind, form = ELEMENTS[fact.kind]
        if not fact.items:
            return kind | ARRAY
        items = [self._string(text) for text in fact.items] if fact.kind is str else fact.items
        self.values += bytes(-len(self.values) % ALIGNMENT)
        offset = self._append(COUNT.pack(len(items)) + struct.pack(f"<{len(items)}{form}", *items))
        return kind | ARRAY | offset

    def _append(self, content: bytes) -> int:
        """Return the offset of bytes after they are written."""
        offset = len(self.values)
        self.values += content
        return offset

    def _string(self, text: str) -> int:
        return self.texts.setdefault(text, self.before + len(self.texts))


def _float_fact(index: int, fact: float, at: int) -> bytes:
    """Return a number of a dictionary, by the index of its name, at an offset."""
    if c_float(fact).value == fact:
        bits = int.from_bytes(FLOAT.pack(fact), "little")
        return INLINE_FACT.pack(index, JUMP.size, NUMBER | bits)
    value = at + INDEX.size + JUMP.size
    return FLOAT_FACT.pack(index, JUMP.size + DOUBLE.size, fact, TYPES[float] | value)


# LZ4, by which tokens are compressed, alternates runs of literal bytes with copies of earlier ones
# (https://github.com/lz4/lz4/blob/dev/doc/lz4_Block_format.md). A run's length is in four bits,
# and if these are full, in further bytes, of which the last is below 255.
FULL = 15


def _last_run(packed: bytes) -> tuple[int, int]:
    """Return the start and the length of the last run of compressed bytes, after the first byte."""
    at = 1
    while True:
        start, head = at, packed[at]
        length, at = _run_length(packed, at + 1, head >> 4)
        at += length
        if at >= len(packed):
            return start, length
        _, at = _run_length(packed, at + 2, head & FULL)


def _run_length(packed: bytes, at: int, length: int) -> tuple[int, int]:
    """Return a length of which four bits are known, and the position after it."""
    while length >= FULL:
        length += packed[at]
        at += 1
        if packed[at - 1] < 255:
            break
    return length, at


def _literal_run(length: int) -> bytes:
    """Return the head of a last run of that length."""
    if length < FULL:
        return bytes([length << 4])
    full, rest = divmod(length - FULL, 255)
    return bytes([FULL << 4]) + b"\xff" * full + bytes([rest])


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

    facts: None for layers without.
    """

    parts: CrateParts
    rate: int
    end: int
    samples: Mapping[str, SamplesPlace]
    values: Mapping[str, int]
    facts: FactPlace | None

    def write(self, rate: float, content: LayerContent) -> bytes:
        """Return the layer of a content, at so many frames a second."""
        data = bytearray(self.parts.values)
        DOUBLE.pack_into(data, self.rate, rate)
        DOUBLE.pack_into(data, self.end, content.frames - 1)
        for name, at in self.values.items():
            value = content.values[name].tobytes()
            data[at : at + len(value)] = value
        times = crate_sections.add_times(data, content.frames)
        for name, samples_place in self.samples.items():
            samples_place.add(data, times, content.samples[name])
        sections = self.parts.sections
        if self.facts is not None:
            tables = self.facts.add(data, content.facts)
            sections = (*tables, *sections[len(tables) :])
        return crate_sections.join_crate(data, sections)


def usdc(author: LayerBuilder, content: LayerContent) -> bytes:
    """Return a binary layer; equal authors and contents have equal bytes."""
    # Layers of all rates and lengths have one template.
    filled = template(author.with_rate(MARKED_RATE), layers.first_frame(content).pattern)
    if filled is None:
        return layers.crate_bytes(author.layer(content))
    return filled.write(author.rate, content)


@lru_cache(maxsize=MAX_TEMPLATES)
def template(author: LayerBuilder, pattern: LayerPattern) -> CrateTemplate | None:
    """Return the template of an author's layers of one pattern; None if it cannot be verified.

    author: of the marked rate. pattern: of a single frame.
    """
    marks = layers.random_content(pattern, {}, seed=1)
    layer = author.layer(marks)
    layer.endTimeCode = MARKED_END
    if pattern.facts:
        layer.customLayerData = {layers.FACTS: MARK}
    crate = crate_sections.split_crate(layers.crate_bytes(layer))
    candidate = crate and _located(crate, marks, pattern.facts)
    return (
        candidate
        if candidate and _is_verified(candidate, author.with_rate(TRIAL_RATE), pattern)
        else None
    )


def _is_verified(candidate: CrateTemplate, author: LayerBuilder, pattern: LayerPattern) -> bool:
    """Return whether usd-core reads filled layers as those that it builds itself."""
    facts = TRIAL_FACTS if pattern.facts else {}
    one = layers.random_content(pattern, facts, seed=2)
    rows = [0, *range(TRIAL_FRAMES), 0]
    random_rows = {
        name: np.random.default_rng(3).standard_normal((TRIAL_FRAMES, *shape[1:]), np.float32)[rows]
        for name, shape in pattern.samples
    }
    return all(
        layers.crate_text(candidate.write(author.rate, content))
        == author.layer(content).ExportToString()
        for content in (one, replace(one, samples=random_rows))
    )


def _located(crate: CrateParts, marks: LayerContent, facts: bool) -> CrateTemplate | None:
    values = crate.values
    rate, end = (values.find(DOUBLE.pack(mark)) for mark in (MARKED_RATE, MARKED_END))
    offsets = {name: values.find(value.tobytes()) for name, value in marks.values.items()}
    samples = {n: crate_sections.find_place(values, row) for n, row in marks.samples.items()}
    fact_place = find_place(crate) if facts else None
    if min(rate, end, *offsets.values()) < 0 or (facts and fact_place is None):
        return None
    located = {
        name: samples_place for name, samples_place in samples.items() if samples_place is not None
    }
    complete = len(located) == len(samples)
    return CrateTemplate(crate, rate, end, located, offsets, fact_place) if complete else None
