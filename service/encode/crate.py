"""Binary USD layers of one pattern: one is written by usd-core, the others are filled in.

usd-core takes a millisecond for a layer; NumPy copies its values to their places in a twentieth of
that. The places are not looked up in the format: a layer is written with numbers that occur once,
they are looked for, and what is filled in must be what usd-core writes, to the byte. Words stay
usd-core's own doing: they are compressed, and taken out of a layer of a single frame.
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

from service.encode import content as contents
from service.encode import facts, layers, sections
from service.encode.content import INLINE, Array, Author, Content, Pattern
from service.encode.facts import Facts
from service.encode.sections import Pieces, Section
from service.motion.conventions import Singles

Bytes = npt.NDArray[np.uint8]

# As USD writes a number that float32 holds, and any other.
FLOAT, DOUBLE = struct.Struct("<f"), struct.Struct("<d")


@dataclass(frozen=True)
class Run:
    """Samples that lie evenly: from offset on, one every stride bytes; and which ones they are."""

    offset: int
    stride: int
    rows: slice

    def fill(self, layer: bytearray, rows: Bytes) -> None:
        """Copy samples (F, width) to their places."""
        chosen, strides = rows[self.rows], (self.stride, 1)
        np.ndarray(chosen.shape, np.uint8, layer, self.offset, strides)[:] = chosen


@dataclass(frozen=True)
class Template:
    """A layer's bytes but for its words, and where in them each sample, value and number lies.

    short: the pattern of a layer of a single frame. apart: names of arrays of one size. USD would
    write equal ones once, and then this is no template of the layer.
    """

    values: bytes
    sections: tuple[Section, ...]
    samples: Mapping[str, tuple[Run, ...]]
    places: Mapping[str, int]
    numbers: tuple[tuple[int, struct.Struct, int], ...]
    short: Pattern
    apart: tuple[tuple[str, str], ...]

    def __len__(self) -> int:
        """Bytes that it takes, about."""
        return len(self.values) + sum(len(section.content) for section in self.sections)

    def write(self, author: Author, content: Content) -> bytes | None:
        """The layer with other content of its pattern; None where it would not be usd-core's."""
        spelt = _words(author, self.short, content.facts.texts)
        if spelt is None or self._merged(author, content):
            return None
        made = bytearray(self.values)
        for name, runs in self.samples.items():
            rows = _bytes(content.samples[name])
            for run in runs:
                run.fill(made, rows)
        for name, at in self.places.items():
            value = content.values[name].tobytes()
            made[at : at + len(value)] = value
        for at, form, index in self.numbers:
            form.pack_into(made, at, content.facts.numbers[index])
        return b"".join((made, sections.tail(made, (spelt, *self.sections))))

    def _merged(self, author: Author, content: Content) -> bool:
        every = _arrays(author, content)
        return any(contents.alike(every[a], every[b]) for a, b in self.apart)


def pattern(author: Author, content: Content) -> Pattern:
    """What decides how the bytes of a layer are laid out."""
    return contents.pattern(content, author.numbers)


def ordinary(author: Author, content: Content) -> bytes:
    """The layer as usd-core writes it."""
    return layers.crate(author.layer(content))


def template(author: Author, content: Content, pattern: Pattern) -> Template | None:
    """Template of an author's layers of one pattern, or None where it cannot be trusted.

    It can where everything is found and where it makes of the content, and of a random one of its
    pattern, the bytes that usd-core makes.
    """
    texts = len(content.facts.texts)
    first, second = (contents.marks(pattern, author.numbers, texts, seed) for seed in (1, 2))
    found = sections.pieces(ordinary(author, first))
    made = found and _located(author, first, pattern, found)
    if not made:
        return None
    right = all(made.write(author, each) == ordinary(author, each) for each in (content, second))
    return made if right else None


@lru_cache(maxsize=1024)
def _words(author: Author, short: Pattern, texts: tuple[str, ...]) -> Section | None:
    """The section of words of an author's layers that hold those texts.

    Kept, for usd-core takes half a millisecond. None where they are not numbered as others are: a
    text that is also the name of a prim is one word with it.
    """
    found, usual = _short(author, short, texts), _usual(author, short, len(texts))
    return found.sections[0] if found and usual and found.alike(usual) else None


@lru_cache(maxsize=16)
def _usual(author: Author, short: Pattern, count: int) -> Pieces | None:
    return _short(author, short, tuple(f"text {index}" for index in range(count)))


def _short(author: Author, short: Pattern, texts: tuple[str, ...]) -> Pieces | None:
    said = Facts(short.facts, (0.0,) * len(short.numbers), texts)
    made = Sdf.Layer.CreateAnonymous("words.usda")
    made.TransferContent(_single(author, short, len(texts)))
    layers.say(made, facts.dictionary(said.whole()))
    return sections.pieces(layers.crate(made))


@lru_cache(maxsize=16)
def _single(author: Author, short: Pattern, count: int) -> Any:
    """Layer of a single frame, which others are copied from: it takes twice as long to make."""
    return author.layer(contents.marks(short, author.numbers, count, seed=0))


def _located(author: Author, marks: Content, pattern: Pattern, found: Pieces) -> Template | None:
    values = found.values
    samples = {name: _runs(values, rows) for name, rows in marks.samples.items()}
    places = {name: values.find(value.tobytes()) for name, value in marks.values.items()}
    numbers = tuple(
        (values.find(form.pack(marks.facts.numbers[index])), form, index)
        for form, index in _filled(pattern, len(author.numbers))
    )
    missing = min((0, *places.values(), *(at for at, _, _ in numbers))) < 0
    if missing or not all(samples.values()):
        return None
    short, apart = contents.short(pattern), tuple(_apart(author, marks))
    return Template(values, found.sections[1:], samples, places, numbers, short, apart)


def _filled(pattern: Pattern, known: int) -> Iterator[tuple[struct.Struct, int]]:
    """How and which numbers are copied into a layer: those that none before is equal to."""
    for index, equal in enumerate(pattern.numbers):
        if equal == INLINE:
            yield FLOAT, index
        elif equal == known + index:
            yield DOUBLE, index


def _runs(values: bytes, marks: Singles) -> tuple[Run, ...]:
    """Runs of evenly spaced samples, of which equal ones lie in one place; none where one lies
    nowhere."""
    first: dict[bytes, int] = {}
    for index, row in enumerate(marks):
        first.setdefault(row.tobytes(), index)
    places: list[int] = []
    for row in first:
        # Samples lie in the order of time.
        places.append(values.find(row, places[-1] if places else 0))
    return () if min(places) < 0 else tuple(_even(list(first.values()), places))


def _even(rows: list[int], places: list[int]) -> Iterator[Run]:
    while rows:
        stride = places[1] - places[0] if len(places) > 1 else 0
        steps = zip(np.diff(rows).tolist(), np.diff(places).tolist(), strict=True)
        uneven = (index for index, step in enumerate(steps, 1) if step != (1, stride))
        count = next(uneven, len(rows))
        yield Run(places[0], stride, slice(rows[0], rows[0] + count))
        rows, places = rows[count:], places[count:]


def _arrays(author: Author, content: Content) -> dict[str, Array]:
    known = {f"known {index}": value for index, value in enumerate(author.values)}
    return {**content.samples, **content.values, **known}


def _apart(author: Author, marks: Content) -> Iterator[tuple[str, str]]:
    """Pairs of arrays, or samples and array, that could be equal."""
    every = _arrays(author, marks)
    of_one = {n: v.shape[1:] if n in marks.samples else v.shape for n, v in every.items()}
    for a, b in combinations(every, 2):
        if of_one[a] == of_one[b]:
            yield a, b


def _bytes(samples: Singles) -> Bytes:
    return np.ascontiguousarray(samples).view(np.uint8).reshape(len(samples), -1)
