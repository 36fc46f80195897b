"""Text of a BVH file, read in blocks, so that memory does not depend on its size."""

import io
import string
from collections.abc import Iterator
from typing import IO

from posefield.common.errors import BvhError

BLOCK = 256_000
"""Bytes per read; parsing their numbers takes fifty times as much memory."""

MAX_BYTES = 1_000_000_000
"""Limit of the file's size: three times 45 minutes of 31 joints at 120 frames a second."""


class TextCursor:
    """Cursor over the characters of a binary file, one per byte (Latin-1).

    Only line feeds end a line; carriage returns are translated. ahead: characters read and not yet
    taken. line: number of the line at the cursor.
    """

    def __init__(self, file: IO[bytes], source: str) -> None:
        self.source, self.ahead, self.line = source, "", 1
        self._file, self._bytes, self._ended = file, 0, False
        self._newlines = io.IncrementalNewlineDecoder(None, translate=True)

    def fill(self, count: int) -> None:
        """Read until `count` characters are ahead, or the file ends.

        Raises BvhError beyond MOST_BYTES.
        """
        while len(self.ahead) < count and not self._ended:
            block = self._file.read(BLOCK)
            self._bytes += len(block)
            if self._bytes > MAX_BYTES:
                most = f"{MAX_BYTES // 1_000_000} MB"
                raise BvhError(self.source, f"found more than {most}, expected at most {most}")
            self._ended = not block
            self.ahead += self._newlines.decode(block.decode("latin-1"), final=self._ended)

    def take(self, count: int) -> str:
        """Return the next characters and advance past them."""
        taken, self.ahead = self.ahead[:count], self.ahead[count:]
        self.line += taken.count("\n")
        return taken

    def take_line(self) -> str:
        """Return the next line that is not blank, without its line feed; empty at the end.

        The cursor then stands before its line feed, so that `line` is its number.
        """
        self.fill(1)
        while blank := len(self.ahead) - len(self.ahead.lstrip(string.whitespace)):
            self.take(blank)
            self.fill(1)
        # A line longer than a block is cut; it cannot match any expected line.
        self.fill(BLOCK)
        return self.take(len(self.ahead.partition("\n")[0]))

    def blocks(self) -> Iterator[str]:
        """Yield the rest of the text in pieces that end with white space, except the last one.

        The cursor stays at the start of a piece until the next is requested. A word longer than a
        block is split.
        """
        self.fill(BLOCK)
        while self.ahead:
            piece = self.ahead[:BLOCK]
            end = max(piece.rfind(blank) for blank in string.whitespace) + 1
            if end and len(self.ahead) >= BLOCK:
                piece = piece[:end]
            yield piece
            self.take(len(piece))
            self.fill(BLOCK)
