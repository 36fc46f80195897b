"""BVH motion files: strict reading, whose errors name the line, and conversion to a clip."""

import io
import re
import string
from collections.abc import Iterator
from dataclasses import dataclass
from typing import IO, Literal, Protocol

import numpy as np

from posefield.common.errors import BvhError
from posefield.common.units import Floats, UpAxis
from posefield.motion import quat
from posefield.motion.clip import Clip
from posefield.motion.skeleton import Skeleton
from posefield_train.source import motion_file as motion_files
from posefield_train.source.bvh_hierarchy import (
    MAX_NUMBER,
    NUMBER,
    BvhJoint,
    Vector,
    decode,
    parse_hierarchy,
    quote,
)
from posefield_train.source.motion_file import MotionFile, RootOffset, snapped_rate

FRAMES = re.compile(r"\s*Frames\s*:\s*(\d{1,18})\s*", re.ASCII | re.IGNORECASE)
FRAME_TIME = re.compile(rf"\s*Frame\s+Time\s*:\s*({NUMBER.pattern})\s*", re.ASCII | re.IGNORECASE)
# A joint can be named MOTION_head, so the section begins at a line of the keyword alone.
MOTION_LINE = re.compile(r"^[ \t]*MOTION[ \t]*$", re.MULTILINE | re.IGNORECASE)

MIN_FRAME_TIME, MAX_FRAME_TIME = 1e-6, 1e6
"""Bounds of a frame time, s."""
MAX_HEADER = 4_000_000
"""Limit of characters before the line MOTION: several times the length of MAX_JOINTS joints."""
MAX_BYTES = 1_000_000_000
"""Limit of the file's size: three times 45 minutes of 31 joints at 120 frames a second."""
MAX_POSES = 10_000_000
"""Limit of frames times joints: 45 minutes of 31 joints at 120 frames a second, 0.6 GB as a clip.

Joints without channels add nothing to the MOTION section, so the file's size does not limit them.
"""
BLOCK = 256_000
"""Bytes per read; parsing their numbers takes fifty times as much memory."""
BLOCK_ROTATIONS = 50_000
"""Rotations that are converted at once."""


@dataclass(frozen=True)
class BvhFile:
    """A file that follows the grammar, without interpretation of unit, up axis or root offset.

    source: its name, for messages. joints: in file order, parents first. tips: the joint index and
    offset of every End Site. values: (F, C), a row per frame, a column per channel, the joints'
    channels one after another, in degrees and the file's unit. frame_time: as written, s. rate:
    frames per second, rounded from the frame time.
    """

    source: str
    joints: tuple[BvhJoint, ...]
    tips: tuple[tuple[int, Vector], ...]
    values: Floats
    frame_time: float
    rate: float


class Readable(Protocol):
    """A pathlib.Path, or a member of an archive."""

    def open(self, mode: Literal["rb"]) -> IO[bytes]:
        """Open the file to be read as bytes."""


def read(path: Readable) -> BvhFile:
    """Return the file at `path`; BvhError if it cannot be read, and as `load`."""
    try:
        with path.open("rb") as file:
            return load(file, str(path))
    except OSError as fault:
        raise BvhError(str(path), f"cannot be read: {fault.strerror}") from fault


def loads(content: bytes, source: str) -> BvhFile:
    """Return the file with the given content, as `load`."""
    return load(io.BytesIO(content), source)


def load(file: IO[bytes], source: str) -> BvhFile:
    """Return the file read from a binary file object; `source` names it in messages.

    At most the numbers of MAX_POSES and a few megabytes are kept in memory, whatever the file's
    size. Raises BvhError for a violation of the grammar or an inconsistency.
    """
    text = _TextCursor(file, source)
    # Read one more block, so that a line that begins before the limit is complete.
    text.fill(MAX_HEADER + BLOCK)
    motion = MOTION_LINE.search(text.ahead)
    size = motion.start() if motion else len(text.ahead)
    end = "MOTION" if motion else "the end of the file"
    if size > MAX_HEADER:
        size, end = MAX_HEADER, f"{MAX_HEADER // 1_000_000} MB without a line MOTION"
    try:
        joints, tips = parse_hierarchy(text.take(size), end)
    except BvhError as fault:
        raise BvhError(source, fault.message, fault.line) from None
    channels = sum(len(joint.channels) for joint in joints)
    if not channels:
        raise text.error(f"found no channel in {len(joints)} joints, expected at least one")
    text.take_line()
    frames = int(_header(text, FRAMES, "'Frames: N', N a whole number"))
    if frames < 1:
        raise text.error("found 0 frames, expected at least 1")
    seconds = _header(text, FRAME_TIME, "'Frame Time: seconds'")
    if not MIN_FRAME_TIME <= float(seconds) <= MAX_FRAME_TIME:
        expected = f"a positive number of seconds from {MIN_FRAME_TIME:g} to {MAX_FRAME_TIME:g}"
        raise text.error(f"found frame time {seconds}, expected {expected}")
    values = _values(text, frames, channels, len(joints))
    return BvhFile(source, joints, tips, values, float(seconds), snapped_rate(float(seconds)))


class _TextCursor:
    """Cursor over the characters of a binary file, one per byte (Latin-1), read in blocks.

    Only line feeds end a line; carriage returns are translated. ahead: characters read and not yet
    taken. line: number of the line at the cursor.
    """

    def __init__(self, file: IO[bytes], source: str) -> None:
        self.source, self.ahead, self.line = source, "", 1
        self._file, self._bytes, self._ended = file, 0, False
        self._newlines = io.IncrementalNewlineDecoder(None, translate=True)

    def error(self, message: str) -> BvhError:
        """Return an error at the line of the cursor."""
        return BvhError(self.source, message, self.line)

    def fill(self, count: int) -> None:
        """Read until `count` characters are ahead or the file ends; BvhError beyond MAX_BYTES."""
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


def _header(text: _TextCursor, pattern: re.Pattern[str], expected: str) -> str:
    """Return the group that the pattern matches in the next line that is not blank."""
    line = text.take_line()
    if match := pattern.fullmatch(line):
        return match.group(1)
    shown = quote(decode(line.strip().encode("latin-1"))) if line else "the end of the file"
    raise text.error(f"found {shown}, expected {expected}")


# Python's float also accepts nan, inf and 1_000, which other characters give away.
NOT_IN_NUMBERS = bytes(set(range(256)) - set(b"0123456789+-.eE \t\n\r\v\f"))
# One list for all blank lines, of which a file can have millions.
EMPTY_ROW: list[bytes] = []


def _values(text: _TextCursor, frames: int, channels: int, joints: int) -> Floats:
    """Return the numbers (frames, channels) of the lines after the frame time.

    A frame may extend over several lines, but not end within one. The total alone is not checked,
    because a line with too few numbers and one with too many would shift all frames between them by
    a column. Memory is allocated for numbers read, not for the count that the file declares.
    """
    # Skip the line feed after the frame time.
    text.fill(1)
    text.take(1)
    expected, most = frames * channels, MAX_POSES // joints * channels
    values, total = np.empty(0), 0
    lines = _LineCounter(frames, channels, text.line)
    for piece in text.blocks():
        block = piece.encode("latin-1")
        rows = [row.split() or EMPTY_ROW for row in block.split(b"\n")]
        numbers = _parse_numbers(block, rows)
        if numbers is None:
            raise _wrong_word(text, rows, expected - total)
        lines.add(rows)
        end = total + len(numbers)
        if end <= min(expected, most):
            if end > len(values):
                size = min(max(end, 2 * len(values)), expected, most)
                values.resize(size, refcheck=False)
            values[total:end] = numbers
        total = end
        if expected > most < total:
            message = f"found {frames} frames of {joints} joints, expected at most {MAX_POSES}"
            raise text.error(f"{message} poses of a joint")
        if total > expected + most:
            raise text.error(
                f"found more than {expected + most} numbers, expected {frames} frames x "
                f"{channels} channels = {expected}"
            )
    lines.end_line()
    if total != expected or lines.ends_inside_line:
        # The first line of a wrong length, else the end of the numbers.
        raise BvhError(
            text.source,
            f"found {total} numbers in {lines.filled} lines, expected {frames} frames x "
            f"{channels} channels = {expected}, each frame on lines of its own",
            lines.wrong_line or lines.last or lines.line,
        )
    return values.reshape(frames, channels)


@dataclass
class _LineCounter:
    """Counts of the numbers on each line, over consecutive blocks.

    line: number of the current line. count: numbers on it so far. before: numbers on the lines
    before. filled: lines before that have numbers, last: the last of them. wrong_line: first line
    of a wrong length. ends_inside_line: whether a line extends past the end of a frame.
    """

    frames: int
    channels: int
    line: int
    count: int = 0
    before: int = 0
    filled: int = 0
    last: int = 0
    wrong_line: int = 0
    ends_inside_line: bool = False

    def add(self, rows: list[list[bytes]]) -> None:
        """Count the words of a block by line, of which the first and last may be parts."""
        first, *others = map(len, rows)
        self.count += first
        for count in others:
            self.end_line()
            self.line, self.count = self.line + 1, count

    def end_line(self) -> None:
        """End the current line."""
        if not self.count:
            return
        if self.count != self.channels or self.filled == self.frames:
            self.wrong_line = self.wrong_line or self.line
        frame, begun = divmod(self.before, self.channels)
        self.ends_inside_line |= begun + self.count > self.channels and frame < self.frames
        self.before, self.filled, self.last = self.before + self.count, self.filled + 1, self.line


def _parse_numbers(block: bytes, rows: list[list[bytes]]) -> Floats | None:
    """Return the numbers of a block's words; None for a word that is none, or above MAX_NUMBER."""
    if len(block.translate(None, NOT_IN_NUMBERS)) != len(block):
        return None
    try:
        numbers = np.array([word for row in rows for word in row], dtype=float)
    except ValueError:
        return None
    return numbers if np.all(np.abs(numbers) <= MAX_NUMBER) else None


def _wrong_word(text: _TextCursor, rows: list[list[bytes]], missing: int) -> BvhError:
    """Return the error for a block's first word that is not a number, or out of range.

    missing: numbers that the file declares from the block on.
    """
    for line, row in enumerate(rows, text.line):
        for content in row:
            word = content.decode("latin-1")
            is_number = NUMBER.fullmatch(word)
            if not is_number or abs(float(word)) > MAX_NUMBER:
                expected = (
                    f", expected at most {MAX_NUMBER:g}" if is_number else ", expected a number"
                )
                if missing <= 0:
                    expected = " after the last frame, expected nothing"
                return BvhError(text.source, f"found {quote(decode(content))}{expected}", line)
            missing -= 1
    raise AssertionError("a block without a fault")


def motion_file(file: BvhFile) -> MotionFile:
    """Return the file's joints and their motion in its own unit and axes.

    A position channel replaces its component of the OFFSET; without a channel the OFFSET stays. The
    rest pose is the file's OFFSETs with identity rotations.
    """
    frames, offsets = len(file.values), np.array([joint.offset for joint in file.joints])
    rotations = np.empty((frames, len(offsets), 4))
    translations = np.tile(offsets, (frames, 1, 1))
    turning: dict[str, list[tuple[int, list[int]]]] = {}
    column = 0
    for index, joint in enumerate(file.joints):
        axes, turns = "", list[int]()
        for channel in joint.channels:
            if channel.endswith("position"):
                translations[:, index, "XYZ".index(channel[0])] = file.values[:, column]
            else:
                axes += channel[0]
                turns.append(column)
            column += 1
        turning.setdefault(axes, []).append((index, turns))
    for axes, alike in turning.items():
        # Convert joints with the same axis order together, in blocks of small arrays.
        step = max(1, BLOCK_ROTATIONS // frames)
        for start in range(0, len(alike), step):
            some = alike[start : start + step]
            angles = np.deg2rad(file.values[:, [turns for _, turns in some]])
            rotations[:, [index for index, _ in some]] = quat.from_euler(angles, axes)
    root = file.joints[0]
    x, y, z = (
        value if f"{axis}position" in root.channels else 0.0
        for axis, value in zip("XYZ", root.offset, strict=True)
    )
    return MotionFile(
        file.source,
        "BVH",
        Skeleton(
            tuple(joint.name for joint in file.joints),
            tuple(joint.parent for joint in file.joints),
            offsets,
            tuple(joint for joint, _ in file.tips),
            np.array([offset for _, offset in file.tips]).reshape(-1, 3),
        ),
        rotations,
        translations,
        file.rate,
        f"frame time {file.frame_time:g} s",
        added_offset=(x, y, z),
    )


def to_clip(file: BvhFile, *, metres_per_unit: float, up: UpAxis, root_offset: RootOffset) -> Clip:
    """Return the file's motion in metres with Y up, as `motion_file.to_clip`."""
    return motion_files.to_clip(
        motion_file(file), metres_per_unit=metres_per_unit, up=up, root_offset=root_offset
    )
