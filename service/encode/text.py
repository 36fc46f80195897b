"""USD text of layers of one shape: one is written by usd-core, the numbers of others are put in."""

from collections.abc import Iterator
from dataclasses import dataclass

from service.encode import content as contents
from service.encode import facts, spelling
from service.encode.content import Author, Content, Pattern
from service.motion.conventions import Singles

INDENT = b"            "
"""As deep as samples lie in our layers."""


@dataclass(frozen=True)
class Template:
    """What stands between the arrays of a layer's prims, and the names of those that follow."""

    between: tuple[bytes, ...]
    names: tuple[str, ...]

    def __len__(self) -> int:
        """Bytes that it takes, about."""
        return sum(map(len, self.between))

    def write(self, author: Author, content: Content) -> bytes | None:
        """The layer with other content of its shape; None where some number is not plain."""
        if not all(map(spelling.plain, (*content.samples.values(), *content.values.values()))):
            return None
        spelt, parts = _spelt(content), [b""] * (2 * len(self.names) + 1)
        parts[::2], parts[1::2] = self.between, [spelt[name] for name in self.names]
        return b"".join((_head(author, content), *parts))


def pattern(author: Author, content: Content) -> Pattern:
    """How the arrays of a content are shaped, which is all that its template hangs on."""
    samples = tuple((name, rows.shape, None) for name, rows in content.samples.items())
    values = tuple((name, found.shape, found.dtype.char) for name, found in content.values.items())
    return Pattern(samples, values, (), facts.NONE.shape)


def ordinary(author: Author, content: Content) -> bytes:
    """The layer as usd-core writes it."""
    text: str = author.layer(content).ExportToString()
    return text.encode()


def template(author: Author, content: Content, pattern: Pattern) -> Template | None:
    """Template of an author's layers of one shape, or None where it cannot be trusted.

    It can where it makes of the content the text that usd-core makes.
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
    """Time samples, from the first time code to the last bracket."""
    spelt = spelling.quaternions(rows) if rows.shape[-1] == 4 else spelling.moves(rows)
    return (b",\n" + INDENT).join(b"%d: [(%b)]" % each for each in enumerate(spelt))


def _holes(body: bytes, spelt: dict[str, bytes]) -> Iterator[tuple[int, int, str]]:
    """Where arrays start and end in a text, and their names."""
    for name, text in spelt.items():
        at = body.find(text)
        while at >= 0:
            yield at, at + len(text), name
            at = body.find(text, at + len(text))
