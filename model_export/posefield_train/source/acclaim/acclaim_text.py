"""Lines of an Acclaim file as words, with line numbers for messages."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import IO, Literal, Protocol

from posefield.common.errors import AcclaimError
from posefield_train.source.bvh.bvh_content import MAX_NUMBER, NUMBER, quote

MAX_BYTES = 500_000_000
"""Limit of a file's size: 45 minutes of 31 joints at 120 frames a second."""


class FileLike(Protocol):
    """A pathlib.Path, or a member of an archive."""

    def open(self, mode: Literal["rb"]) -> IO[bytes]:
        """Open the file to be read as bytes."""


@dataclass(frozen=True)
class Line:
    """Words of one line. source: the file's name. number: of the line, from 1."""

    source: str
    number: int
    words: tuple[str, ...]

    def error(self, message: str) -> AcclaimError:
        """Return an error that names the file and this line."""
        return AcclaimError(self.source, message, self.number)

    def unexpected(self, expected: str) -> AcclaimError:
        """Return an error with the line as found and as expected."""
        return self.error(f"found {quote(' '.join(self.words))}, expected {expected}")

    def numbers(self, words: Sequence[str], count: int, expected: str) -> tuple[float, ...]:
        """Return words as finite numbers; AcclaimError unless there are `count` of them."""
        if len(words) != count or not all(NUMBER.fullmatch(word) for word in words):
            raise self.unexpected(expected)
        values = tuple(map(float, words))
        if not all(math.isfinite(value) and abs(value) <= MAX_NUMBER for value in values):
            raise self.unexpected(f"numbers of at most {MAX_NUMBER:g}")
        return values


def read_lines(place: FileLike) -> Iterator[Line]:
    """Yield the lines of a file that have words, without comments.

    Any byte is text (Latin-1), since paths in comments have letters of their authors' code pages.
    Raises AcclaimError if the file cannot be read, or is too large.
    """
    source = str(place)
    try:
        with place.open("rb") as file:
            content = file.read(MAX_BYTES + 1)
    except OSError as fault:
        raise AcclaimError(source, f"cannot be read: {fault.strerror}") from fault
    if len(content) > MAX_BYTES:
        raise AcclaimError(source, f"found more than {MAX_BYTES} bytes, expected at most as many")
    for number, text in enumerate(content.decode("latin-1").split("\n"), 1):
        words = tuple(text.partition("#")[0].split())
        if words:
            yield Line(source, number, words)
