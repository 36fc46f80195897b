"""The MOTION section: a count of frames, a frame time, and a row of numbers a frame."""

import re
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from service.motion.bvh.grammar import LARGEST, NUMBER, brief
from service.motion.conventions import Floats
from service.motion.errors import BvhError

FRAMES = re.compile(r"\s*Frames\s*:\s*(\d{1,18})\s*", re.ASCII | re.IGNORECASE)
FRAME_TIME = re.compile(rf"\s*Frame\s+Time\s*:\s*({NUMBER.pattern})\s*", re.ASCII | re.IGNORECASE)
SHORTEST, LONGEST = 1e-6, 1e6
"""Bounds of a frame time in seconds, outside of which its inverse is no rate."""

BROADCAST_RATES = tuple(1000.0 * base / 1001.0 for base in (24, 30, 60, 120))
SNAP = 1e-4
"""Relative error of a frame time cut to few digits, such as .008333 or 0.0333333."""


def snapped_rate(frame_time: float) -> float:
    """Frames a second: the nearest whole or broadcast rate within SNAP, else the inverse."""
    rate = 1.0 / frame_time
    nearest = min((max(1.0, float(round(rate))), *BROADCAST_RATES), key=lambda c: abs(c - rate))
    return nearest if abs(nearest - rate) <= SNAP * nearest else rate


@dataclass(frozen=True)
class Motion:
    """The lines after MOTION and the number of the first of them."""

    source: str
    lines: list[str]
    first_line: int

    def error(self, message: str, index: int) -> BvhError:
        """The error at a line of the section."""
        return BvhError(self.source, message, self.first_line + index)

    def read(self, channels: int) -> tuple[float, Floats]:
        """Frame time and values (frames, channels)."""
        used, frames = self.header(0, FRAMES, "'Frames: N', N a whole number")
        if int(frames) < 1:
            raise self.error("found 0 frames, expected at least 1", used - 1)
        used, seconds = self.header(used, FRAME_TIME, "'Frame Time: seconds'")
        if not SHORTEST <= float(seconds) <= LONGEST:
            expected = f"a positive number of seconds from {SHORTEST:g} to {LONGEST:g}"
            raise self.error(f"found frame time {seconds}, expected {expected}", used - 1)
        return float(seconds), self.values(used, int(frames), channels)

    def header(self, start: int, pattern: re.Pattern[str], expected: str) -> tuple[int, str]:
        """Index behind the next line that is not blank, and what the pattern caught in it."""
        for index in range(start, len(self.lines)):
            if match := pattern.fullmatch(self.lines[index]):
                return index + 1, match.group(1)
            if self.lines[index].strip():
                raise self.error(
                    f"found {brief(self.lines[index].strip())}, expected {expected}", index
                )
        raise self.error(f"found the end of the file, expected {expected}", len(self.lines) - 1)

    def values(self, start: int, frames: int, channels: int) -> Floats:
        """Numbers (frames, channels) of the lines from `start`."""
        rows = [line.split() for line in self.lines[start:]]
        words = [word for row in rows for word in row]
        numbers = parse(words)
        if numbers is None:
            raise self.wrong_word(start, frames * channels)
        self.refuse_count(start, [len(row) for row in rows], frames, channels)
        return numbers.reshape(frames, channels)

    def numbered_words(self, start: int) -> Iterator[tuple[int, str]]:
        """Line index and word of all that stands from `start`."""
        for index in range(start, len(self.lines)):
            for word in self.lines[index].split():
                yield index, word

    def wrong_word(self, start: int, expected: int) -> BvhError:
        """The error of the first word that is no number, or none that a pose can hold."""
        count, index, word = next(
            (count, index, word)
            for count, (index, word) in enumerate(self.numbered_words(start))
            if not NUMBER.fullmatch(word) or abs(float(word)) > LARGEST
        )
        if count >= expected:
            return self.error(f"found {brief(word)} after the last frame, expected nothing", index)
        wanted = f"at most {LARGEST:g}" if NUMBER.fullmatch(word) else "a number"
        return self.error(f"found {brief(word)}, expected {wanted}", index)

    def refuse_count(self, start: int, counts: list[int], frames: int, channels: int) -> None:
        """Refuse too few or too many numbers, and a frame that ends inside a line.

        A frame may go on over several lines. Where a line of too few is made up for by one of too
        many, all frames between would be shifted by a column.
        """
        ends = np.cumsum(counts, dtype=np.int64)
        total = int(ends[-1]) if len(ends) else 0
        whole = np.arange(1, min(frames, total // channels) + 1) * channels
        cut = np.flatnonzero(~np.isin(whole, ends))
        if total == frames * channels and not len(cut):
            return
        raise self.error(
            f"found {total} numbers in {np.count_nonzero(counts)} lines, expected {frames} frames "
            f"x {channels} channels = {frames * channels}, each frame on lines of its own",
            start + odd_line(counts, frames, channels),
        )


def parse(words: list[str]) -> Floats | None:
    """Numbers of the words, or None where one is no number, not finite or past LARGEST."""
    # Python's float also takes nan, inf and 1_000, whose characters are refused here.
    text = "".join(words)
    if not text.isascii() or text.encode().translate(None, b"0123456789+-.eE"):
        return None
    try:
        numbers = np.array(words, dtype=float)
    except ValueError:
        return None
    return numbers if np.all(np.abs(numbers) <= LARGEST) else None


def odd_line(counts: list[int], frames: int, channels: int) -> int:
    """Index of the first line of a wrong length, else of the line where the data goes wrong."""
    filled = [index for index, count in enumerate(counts) if count]
    for row, index in enumerate(filled):
        if counts[index] != channels or row == frames:
            return index
    return filled[-1] if filled else max(len(counts) - 1, 0)
