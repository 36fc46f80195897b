"""Templates of USD text layers: usd-core writes one layer of a shape, others get their numbers."""

from collections.abc import Iterator
from dataclasses import dataclass

from service.encode import content as contents
from service.encode import facts, spelling
from service.encode.content import Author, Content, Pattern
from service.motion.conventions import Singles

INDENT = b"            "
"""Indentation of time samples in the layers of this package."""


@dataclass(frozen=True)
class Template:
    """Text between the arrays of a layer, and the names of the arrays in order."""

    between: tuple[bytes, ...]
    names: tuple[str, ...]

    def __len__(self) -> int:
        """Return the approximate bytes of the template in memory."""
        return sum(map(len, self.between))

    def write(self, author: Author, content: Content) -> bytes | None:
        """Return the layer with other content of its shape.

        None if orjson and usd-core format some number differently.
        """
        if not all(map(spelling.plain, (*content.samples.values(), *content.values.values()))):
            return None
        spelt, parts = _spelt(content), [b""] * (2 * len(self.names) + 1)
        parts[::2], parts[1::2] = self.between, [spelt[name] for name in self.names]
        return b"".join((_head(author, content), *parts))


def pattern(author: Author, content: Content) -> Pattern:
    """Return the shapes of the arrays of a content, on which alone its template depends."""
    samples = tuple((name, rows.shape, None) for name, rows in content.samples.items())
    values = tuple((name, found.shape, found.dtype.char) for name, found in content.values.items())
    return Pattern(samples, values, (), facts.NONE.shape)


def ordinary(author: Author, content: Content) -> bytes:
    """Return the layer as written by usd-core."""
    text: str = author.layer(content).ExportToString()
    return text.encode()


def template(author: Author, content: Content, pattern: Pattern) -> Template | None:
    """Return a template of an author's layers of one shape; None if it cannot be verified.

    It is verified if it writes the same text as usd-core for the content.
    """
    marks = contents.marks(pattern, author.numbers, 0, seed=1)
    body = ordinary(author, marks).removeprefix(_head(author, marks))
    holes = sorted(_holes(body, _spelt(marks)))
    starts, ends = [0, *(end for _, end, _ in holes)], [*(at for at, _, _ in holes), len(body)]
    between = tuple(body[start:end] for start, end in zip(starts, ends, strict=True))
    made = Template(between, tuple(name for _, _, name in holes))
    return made if made.write(author, content) == ordinary(author, content) else None


def _head(author: Author, content: Content) -> bytes:
    text: str = author.head(content).ExportToString()
    return text.encode()


def _spelt(content: Content) -> dict[str, bytes]:
    samples = {name: _samples(rows) for name, rows in content.samples.items()}
    return samples | {name: spelling.array(value) for name, value in content.values.items()}


def _samples(rows: Singles) -> bytes:
    """Return time samples as text, from the first time code to the last bracket."""
    spelt = spelling.quaternions(rows) if rows.shape[-1] == 4 else spelling.moves(rows)
    return (b",\n" + INDENT).join(b"%d: [(%b)]" % each for each in enumerate(spelt))


def _holes(body: bytes, spelt: dict[str, bytes]) -> Iterator[tuple[int, int, str]]:
    """Yield start, end and name of each array in a text."""
    for name, text in spelt.items():
        at = body.find(text)
        while at >= 0:
            yield at, at + len(text), name
            at = body.find(text, at + len(text))
