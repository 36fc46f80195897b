"""Parser of the MOTION section: a frame count, a frame time and lines of numbers."""

import re
from dataclasses import dataclass

import numpy as np

from posefield.common.errors import BvhError
from posefield.common.units import Floats
from posefield_train.source.bvh.bvh_content import MAX_NUMBER, NUMBER, decode, quote
from posefield_train.source.bvh.bvh_rows import NumberBuffer, RowCounter
from posefield_train.source.bvh.bvh_text import TextCursor

FRAMES = re.compile(r"\s*Frames\s*:\s*(\d{1,18})\s*", re.ASCII | re.IGNORECASE)
FRAME_TIME = re.compile(rf"\s*Frame\s+Time\s*:\s*({NUMBER.pattern})\s*", re.ASCII | re.IGNORECASE)
MIN_FRAME_TIME, LONGEST = 1e-6, 1e6
"""Bounds of a frame time, s."""

NOT_IN_NUMBERS = bytes(set(range(256)) - set(b"0123456789+-.eE \t\n\r\v\f"))


@dataclass(frozen=True)
class MotionReader:
    """The text after the line MOTION. most: largest number of values kept in memory."""

    text: TextCursor
    max_values: int

    def error(self, message: str, line: int) -> BvhError:
        """Return the error at a line of the file."""
        return BvhError(self.text.source, message, line)

    def read(self, channels: int) -> tuple[float, int, Floats]:
        """Return frame time, number of frames and values (frames, channels).

        If the file both declares and contains more than `max_values` numbers, the values are empty.
        """
        frames = int(self.header(FRAMES, "'Frames: N', N a whole number"))
        if frames < 1:
            raise self.error("found 0 frames, expected at least 1", self.text.line)
        seconds = self.header(FRAME_TIME, "'Frame Time: seconds'")
        if not MIN_FRAME_TIME <= float(seconds) <= LONGEST:
            expected = f"a positive number of seconds from {MIN_FRAME_TIME:g} to {LONGEST:g}"
            raise self.error(f"found frame time {seconds}, expected {expected}", self.text.line)
        return float(seconds), frames, self.values(frames, channels)

    def header(self, pattern: re.Pattern[str], expected: str) -> str:
        """Return the group that the pattern matches in the next line that is not blank."""
        line = self.text.take_line()
        if match := pattern.fullmatch(line):
            return match.group(1)
        found = quote(decode(line.strip().encode("latin-1"))) if line else "the end of the file"
        raise self.error(f"found {found}, expected {expected}", self.text.line)

    def values(self, frames: int, channels: int) -> Floats:
        """Return the numbers (frames, channels) of the remaining lines; empty as for `read`."""
        # Skip the line feed after the frame time.
        self.text.fill(1)
        self.text.take(1)
        rows, held = (
            RowCounter(frames, channels, self.text.line),
            NumberBuffer(min(frames * channels, self.max_values)),
        )
        for piece in self.text.blocks():
            if not piece.strip():
                rows.pass_blank(piece.count("\n"))
                continue
            held.add(self.numbers(piece, rows))
            if rows.expected > self.max_values < rows.total:
                return np.empty(0)
            if rows.total > rows.expected + self.max_values:
                raise self.far_too_many(rows)
        rows.finish()
        if fault := rows.fault:
            raise self.error(*fault)
        return held.numbers.reshape(frames, channels)

    def numbers(self, piece: str, rows: RowCounter) -> Floats:
        """Return the numbers of a piece of the text and add them to the count of `rows`."""
        block = piece.encode("latin-1")
        numbers = parse_numbers(block)
        if numbers is None:
            raise self.wrong_word(block, rows.total, rows.expected)
        rows.add(block)
        return numbers

    def far_too_many(self, rows: RowCounter) -> BvhError:
        """Return the error for so many excess numbers that the rest is not counted."""
        message = (
            f"found more than {rows.expected + self.max_values} numbers, expected "
            f"{rows.frames} frames x "
            f"{rows.channels} channels = {rows.expected}"
        )
        return self.error(message, self.text.line)

    def wrong_word(self, block: bytes, before: int, expected: int) -> BvhError:
        """Return the error for a block's first word that is not a number, or out of range."""
        line = self.text.line
        for text in block.decode("latin-1").split("\n"):
            for word in text.encode("latin-1").split():
                if not NUMBER.fullmatch(word.decode("latin-1")) or abs(float(word)) > MAX_NUMBER:
                    return self.error(_word_error(decode(word), before >= expected), line)
                before += 1
            line += 1
        raise AssertionError("a block without a fault")


def _word_error(word: str, after_the_last: bool) -> str:
    if after_the_last:
        return f"found {quote(word)} after the last frame, expected nothing"
    wanted = f"at most {MAX_NUMBER:g}" if NUMBER.fullmatch(word) else "a number"
    return f"found {quote(word)}, expected {wanted}"


def parse_numbers(block: bytes) -> Floats | None:
    """Return the numbers of a block's words.

    None if a word is not a number, not finite, or above LARGEST.
    """
    # Python's float also accepts nan, inf and 1_000; refuse their characters.
    if len(block.translate(None, NOT_IN_NUMBERS)) != len(block):
        return None
    try:
        numbers = np.array(block.split(), dtype=float)
    except ValueError:
        return None
    return numbers if np.all(np.abs(numbers) <= MAX_NUMBER) else None
