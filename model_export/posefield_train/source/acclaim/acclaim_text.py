"""Lines of an Acclaim file as words, with line numbers for messages."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import IO, Literal, Protocol

from posefield.common.errors import AcclaimError
from posefield_train.source.bvh.bvh_content import MAX_NUMBER, NUMBER, quote

MAX_LINE = 10_000
"""Limit of a line's length, bytes: hundreds of times that of a bone with six numbers."""


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


def read_lines(place: FileLike, most: int) -> Iterator[Line]:
    """Yield the lines of a file that have words, without comments.

    most: limit of the file's size, bytes. Any byte is text (Latin-1), since comments have paths in
    the code pages of their authors. Raises AcclaimError if the file cannot be read, is larger, or
    has a line longer than MAX_LINE; lines are read one at a time.
    """
    source, read, number = str(place), 0, 0
    try:
        with place.open("rb") as file:
            while content := file.readline(MAX_LINE + 1):
                read, number = read + len(content), number + 1
                if len(content) > MAX_LINE or read > most:
                    expected = f"expected at most {MAX_LINE} bytes a line and {most} in all"
                    raise AcclaimError(source, f"found more bytes than allowed, {expected}", number)
                words = tuple(content.decode("latin-1").partition("#")[0].split())
                if words:
                    yield Line(source, number, words)
    except OSError as fault:
        raise AcclaimError(source, f"cannot be read: {fault.strerror}") from fault
