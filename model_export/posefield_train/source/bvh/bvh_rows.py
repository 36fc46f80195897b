"""Counts of the numbers on each line of a MOTION section."""

from dataclasses import dataclass

import numpy as np

from posefield.common.units import Floats, Indices

BLANK = np.isin(np.arange(256), list(b" \t\n\r\v\f"))
"""Mask (256,) of the bytes that separate words."""


@dataclass
class RowCounter:
    """Counts of the numbers on each line, over consecutive blocks.

    A frame may extend over several lines. The total alone is not checked, because a line with too
    few numbers and one with too many would shift all frames between them by a column.

    line: number of the line at which the next block starts. total: numbers so far. filled: complete
    lines with numbers. begun: numbers before the line at which the next block starts. odd: the
    first line of a wrong length. last: the last line with numbers. torn: True if a line extends
    past the end of a frame.
    """

    frames: int
    channels: int
    line: int
    total: int = 0
    filled: int = 0
    begun: int = 0
    wrong_line: int | None = None
    last: int | None = None
    ends_inside_line: bool = False

    @property
    def expected(self) -> int:
        """Return how many numbers the file declares."""
        return self.frames * self.channels

    def pass_blank(self, lines: int) -> None:
        """Count a blank block with the given number of line feeds."""
        if lines:
            self._end(np.array([self.total]), np.array([self.line]))
            self.line += lines

    def add(self, block: bytes) -> None:
        """Count a block of words that are numbers."""
        codes = np.frombuffer(block, np.uint8)
        blank = BLANK[codes]
        begins = ~blank
        begins[1:] &= blank[:-1]
        words = np.cumsum(begins, dtype=np.int32)
        feeds = np.flatnonzero(codes == ord("\n"))
        ends = self.total + words[feeds].astype(np.int64)
        self.total += int(words[-1])
        self._end(ends, self.line + np.arange(len(feeds)))
        self.line += len(feeds)

    def finish(self) -> None:
        """End the last line, which may lack a line feed."""
        self._end(np.array([self.total]), np.array([self.line]))

    def _end(self, ends: Indices, lines: Indices) -> None:
        """End lines at the given counts of numbers of the section."""
        starts = np.concatenate([[self.begun], ends[:-1]])
        filled = ends > starts
        starts, ends, lines = starts[filled], ends[filled], lines[filled]
        if not len(ends):
            return
        rows = self.filled + np.arange(len(ends))
        odd = np.flatnonzero((ends - starts != self.channels) | (rows == self.frames))
        if self.wrong_line is None and len(odd):
            self.wrong_line = int(lines[odd[0]])
        inner = starts // self.channels + 1
        self.ends_inside_line |= bool(
            np.any((inner * self.channels < ends) & (inner <= self.frames))
        )
        self.filled += len(ends)
        self.begun, self.last = int(ends[-1]), int(lines[-1])

    @property
    def fault(self) -> tuple[str, int] | None:
        """Return message and line of a wrong count, or of a frame that ends inside a line, or None.

        The line is the first one of a wrong length, else the end of the numbers.
        """
        if self.total == self.expected and not self.ends_inside_line:
            return None
        message = (
            f"found {self.total} numbers in {self.filled} lines, expected {self.frames} frames x "
            f"{self.channels} channels = {self.expected}, each frame on lines of its own"
        )
        return message, next(
            line for line in (self.wrong_line, self.last, self.line) if line is not None
        )


class NumberBuffer:
    """Numbers of a MOTION section, up to `most`.

    Memory is allocated for numbers read, not for the count that the file declares.
    """

    def __init__(self, most: int) -> None:
        self._most, self._count, self._room = most, 0, np.empty(0)

    def add(self, numbers: Floats) -> None:
        """Append numbers, unless the total would exceed `most`."""
        end = self._count + len(numbers)
        if end > self._most:
            return
        if end > len(self._room):
            size = min(max(end, 2 * len(self._room)), self._most)
            self._room.resize(size, refcheck=False)
        self._room[self._count : end] = numbers
        self._count = end

    @property
    def numbers(self) -> Floats:
        """Return all numbers kept."""
        return self._room[: self._count]
