"""Templates of USD text layers: usd-core writes one layer of a shape, others get their numbers."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import orjson

from posefield.common.units import Floats, Singles
from posefield.encode.usd_layers import layer_content as contents
from posefield.encode.usd_layers.layer_content import (
    Array,
    LayerBuilder,
    LayerContent,
    LayerPattern,
)

INDENT = b"            "
"""Indentation of time samples in the layers of this package."""


@dataclass(frozen=True)
class TextTemplate:
    """Text between the arrays of a layer, and the names of the arrays in order."""

    between: tuple[bytes, ...]
    names: tuple[str, ...]

    def __len__(self) -> int:
        """Return the approximate bytes of the template in memory."""
        return sum(map(len, self.between))

    def write(self, author: LayerBuilder, content: LayerContent) -> bytes | None:
        """Return the layer with other content of its shape.

        None if orjson and usd-core format some number differently.
        """
        if not all(map(all_plain, (*content.samples.values(), *content.values.values()))):
            return None
        spelt, parts = _array_texts(content), [b""] * (2 * len(self.names) + 1)
        parts[::2], parts[1::2] = self.between, [spelt[name] for name in self.names]
        return b"".join((_head(author, content), *parts))


def pattern(content: LayerContent) -> LayerPattern:
    """Return the shapes of the arrays of a content, on which alone its template depends."""
    return content.pattern._replace(facts=False)


def ordinary(author: LayerBuilder, content: LayerContent) -> bytes:
    """Return the layer as written by usd-core."""
    text: str = author.layer(content).ExportToString()
    return text.encode()


def template(
    author: LayerBuilder, content: LayerContent, pattern: LayerPattern
) -> TextTemplate | None:
    """Return a template of an author's layers of one shape; None if it cannot be verified.

    It is verified if it writes the same text as usd-core for the content.
    """
    marks = contents.random_content(pattern, {}, seed=1)
    body = ordinary(author, marks).removeprefix(_head(author, marks))
    holes = sorted(_array_spans(body, _array_texts(marks)))
    starts, ends = [0, *(end for _, end, _ in holes)], [*(at for at, _, _ in holes), len(body)]
    between = tuple(body[start:end] for start, end in zip(starts, ends, strict=True))
    made = TextTemplate(between, tuple(name for _, _, name in holes))
    return made if made.write(author, content) == ordinary(author, content) else None


def _head(author: LayerBuilder, content: LayerContent) -> bytes:
    text: str = author.head(content).ExportToString()
    return text.encode()


def _array_texts(content: LayerContent) -> dict[str, bytes]:
    samples = {name: _samples_text(rows) for name, rows in content.samples.items()}
    return samples | {name: array_text(value) for name, value in content.values.items()}


def _samples_text(rows: Singles) -> bytes:
    """Return time samples as text, from the first time code to the last bracket."""
    if rows.ndim == 2:
        spelt, form = row_texts(rows[:, None]), b"%d: [%b]"
    else:
        spelt = quaternion_texts(rows) if rows.shape[-1] == 4 else vector_texts(rows)
        form = b"%d: [(%b)]"
    return (b",\n" + INDENT).join(form % each for each in enumerate(spelt))


def _array_spans(body: bytes, spelt: dict[str, bytes]) -> Iterator[tuple[int, int, str]]:
    """Yield start, end and name of each array in a text."""
    for name, text in spelt.items():
        at = body.find(text)
        while at >= 0:
            yield at, at + len(text), name
            at = body.find(text, at + len(text))


LARGEST_PLAIN = 1e13
"""Smallest number that orjson writes with an exponent; usd-core starts later."""
SMALLEST_PLAIN = 1e-5
"""Largest float64 below which orjson writes an exponent; usd-core starts later."""


def all_plain(values: Array) -> bool:
    """Return whether orjson and usd-core agree on all numbers; they do not on NaN and infinity."""
    sizes = np.abs(values)
    small = values.dtype == np.float64 and np.any((sizes < SMALLEST_PLAIN) & (sizes > 0))
    return not small and bool(np.all(sizes < LARGEST_PLAIN))


def array_text(values: Array) -> bytes:
    """Return vectors (N, 3) in float32 or matrices (N, 4, 4) in float64, in square brackets."""
    if values.ndim == 2:
        return b"[(%b)]" % row_texts(values[None])[0]
    return b"[%b]" % b", ".join(b"( (%b) )" % rows for rows in row_texts(values))


def vector_texts(rows: Singles) -> list[bytes]:
    """Return the text of each row of vectors (F, N, 3).

    If all but the first vector are constant, those are formatted once.
    """
    if rows.shape[1] == 1 or np.any(rows[:, 1:] != rows[:1, 1:]):
        return row_texts(rows)
    (same,) = row_texts(rows[:1, 1:])
    return [b"%b), (%b" % (first, same) for first in row_texts(rows[:, :1])]


def quaternion_texts(rows: Singles) -> list[bytes]:
    """Return the text of each row of quaternions (F, N, 4).

    The real part is last in the array and first in the text.
    """
    return row_texts(rows[..., [3, 0, 1, 2]])


def row_texts(rows: Singles | Floats) -> list[bytes]:
    """Return the text of each row of (F, N, n) without the outer brackets: `1, 2), (3, 4`."""
    data = orjson.dumps(np.ascontiguousarray(rows), option=orjson.OPT_SERIALIZE_NUMPY)
    if np.any(rows == np.trunc(rows)):
        data = data.replace(b".0,", b",").replace(b".0]", b"]")
    data = data.replace(b",", b", ").replace(b"], [", b"), (")
    return data[3:-3].split(b"]), ([")
