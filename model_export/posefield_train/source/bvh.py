"""BVH motion files: strict reading, whose errors name the line, and conversion to a clip."""

import array
import io
import re
import string
from collections.abc import Iterator
from contextlib import suppress
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
    CHANNELS,
    MAX_NUMBER,
    NUMBER,
    BvhJoint,
    Vector,
    decode,
    foreign_encoding,
    parse_hierarchy,
    quote,
)
from posefield_train.source.motion_file import MotionFile, RootOffset, rate_of_digits

FRAMES = re.compile(r"\s*Frames\s*:\s*(\d{1,18})\s*", re.ASCII | re.IGNORECASE)
FRAME_TIME = re.compile(rf"\s*Frame\s+Time\s*:\s*({NUMBER.pattern})\s*", re.ASCII | re.IGNORECASE)
# A joint can be named MOTION_head, so the section begins at a line of the keyword alone.
MOTION_LINE = re.compile(r"[ \t]*MOTION[ \t]*\n?", re.IGNORECASE)

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
RELATIVE = 0.1
"""Share of the OFFSETs below which the mean positions of joints are taken as relative to them."""
MAX_LINE = 256_000
"""Limit of a line, characters: twice that of a frame of MAX_JOINTS joints."""
BLOCK_ROTATIONS = 50_000
"""Rotations that are converted at once."""


@dataclass(frozen=True)
class BvhFile:
    """A file that follows the grammar, without interpretation of unit, up axis or root offset.

    source: its name, for messages. joints: in file order, parents first. tips: the joint index and
    offset of every End Site. values: (F, C), a row per frame, a column per channel, the joints'
    channels one after another, in degrees and the file's unit. frame_time: as written, s. rate:
    frames per second, rounded from the frame time. notes: on what the reader assumed.
    """

    source: str
    joints: tuple[BvhJoint, ...]
    tips: tuple[tuple[int, Vector], ...]
    values: Floats
    frame_time: float
    rate: float
    notes: tuple[str, ...] = ()


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
    text = io.TextIOWrapper(file, "latin-1")
    try:
        return _load(_Lines(text, source), source)
    finally:
        # The caller closes the file.
        text.detach()


def _load(lines: "_Lines", source: str) -> BvhFile:
    head, size, end = list[str](), 0, "the end of the file"
    for line in lines:
        if MOTION_LINE.fullmatch(line):
            end = "MOTION"
            break
        head.append(line)
        size += len(line)
        if size >= MAX_HEADER:
            end = f"{MAX_HEADER // 1_000_000} MB without a line MOTION"
            break
    try:
        joints, tips = parse_hierarchy("".join(head), end)
    except BvhError as fault:
        raise BvhError(source, fault.message, fault.line) from None
    channels = sum(len(joint.channels) for joint in joints)
    if not channels:
        raise lines.error(f"found no channel in {len(joints)} joints, expected at least one")
    frames = int(_header(lines, FRAMES, "'Frames: N', N a whole number"))
    if frames < 1:
        raise lines.error("found 0 frames, expected at least 1")
    seconds = _header(lines, FRAME_TIME, "'Frame Time: seconds'")
    if not MIN_FRAME_TIME <= float(seconds) <= MAX_FRAME_TIME:
        expected = f"a positive number of seconds from {MIN_FRAME_TIME:g} to {MAX_FRAME_TIME:g}"
        raise lines.error(f"found frame time {seconds}, expected {expected}")
    values = _values(lines, frames, channels, len(joints))
    rate, notes = rate_of_digits(seconds)
    if len(values) != frames:
        notes += (f"states {frames} frames and has {len(values)}: those were read",)
    return BvhFile(source, joints, tips, values, float(seconds), rate, notes)


class _Lines:
    """Lines of a file, a character per byte (Latin-1), with any line ends.

    number: of the last line, from 1. Raises BvhError for another encoding, for a line longer than
    MAX_LINE, and beyond MAX_BYTES.
    """

    def __init__(self, text: io.TextIOWrapper, source: str) -> None:
        self.source, self.number = source, 0
        self._text, self._read = text, 0

    def __iter__(self) -> Iterator[str]:
        while line := self._text.readline(MAX_LINE):
            self.number, self._read = self.number + 1, self._read + len(line)
            packed = foreign_encoding(line[:4].encode("latin-1")) if self.number == 1 else ""
            if packed:
                raise self.error(f"found {packed}, expected HIERARCHY, as plain text")
            if len(line) == MAX_LINE:
                raise self.error(f"found {MAX_LINE} characters in a line, expected fewer")
            if self._read > MAX_BYTES:
                limit = f"{MAX_BYTES // 1_000_000} MB"
                raise BvhError(self.source, f"found more than {limit}, expected at most {limit}")
            yield line

    def error(self, message: str) -> BvhError:
        """Return an error at the last line."""
        return BvhError(self.source, message, self.number)


def _header(lines: _Lines, pattern: re.Pattern[str], expected: str) -> str:
    """Return the group that the pattern matches in the next line that is not blank."""
    line = next((line.strip() for line in lines if not line.isspace()), "")
    if match := pattern.fullmatch(line):
        return match.group(1)
    quoted = quote(decode(line.encode("latin-1"))) if line else "the end of the file"
    raise lines.error(f"found {quoted}, expected {expected}")


IN_NUMBERS = "0123456789+-.eE" + string.whitespace
"""Characters of finite numbers; Python's float also accepts nan, inf and 1_000."""


def _values(lines: _Lines, frames: int, channels: int, joints: int) -> Floats:
    """Return the numbers (frames, channels) of the lines after the frame time.

    A frame may extend over several lines, but not end within one. There may be one frame more or
    less than declared, as some exporters count. Memory is allocated for numbers read, not for the
    count that the file declares.
    """
    values, begin = array.array("d"), lines.number
    for line in lines:
        if line.isspace():
            continue
        numbers = _numbers(lines, line, frames * channels - len(values))
        started = len(values) % channels
        begin = begin if started else lines.number
        if started + len(numbers) > channels:
            split = f"{started} and then {len(numbers)}" if started else len(numbers)
            message = f"found {split} numbers, expected {channels} a frame, on lines of its own"
            raise BvhError(lines.source, message, begin)
        values.extend(numbers)
        if len(values) > (frames + 1) * channels:
            raise lines.error(f"found more than {frames + 1} frames, expected {frames}")
        if len(values) // channels * joints > MAX_POSES:
            message = f"found {frames} frames of {joints} joints, expected at most {MAX_POSES}"
            raise lines.error(f"{message} poses of a joint")
    count, rest = divmod(len(values), channels)
    if rest:
        message = f"found {rest} numbers, expected {channels} a frame, on lines of its own"
        raise BvhError(lines.source, message, begin)
    if not count or count < frames - 1:
        raise lines.error(f"found {count} frames, expected {frames}")
    return np.frombuffer(values).reshape(count, channels)


def _numbers(lines: _Lines, line: str, missing: int) -> list[float]:
    """Return the numbers of a line; BvhError for its first word that is none, or out of range.

    missing: numbers that the file declares from the line on.
    """
    words, numbers = line.split(), list[float]()
    with suppress(ValueError):
        numbers = [] if line.strip(IN_NUMBERS) else [*map(float, words)]
    if len(numbers) == len(words) and -MAX_NUMBER <= min(numbers, default=0.0):
        if max(numbers, default=0.0) <= MAX_NUMBER:
            return numbers
    wrong = (w for w in words if not NUMBER.fullmatch(w) or abs(float(w)) > MAX_NUMBER)
    word = next(wrong, line.strip(IN_NUMBERS))
    expected = ", expected a number"
    if missing <= 0:
        expected = " after the last frame, expected nothing"
    elif NUMBER.fullmatch(word):
        expected = f", expected at most {MAX_NUMBER:g}"
    raise lines.error(f"found {quote(decode(word.encode('latin-1')))}{expected}")


def motion_file(file: BvhFile) -> MotionFile:
    """Return the file's joints and their motion in its own unit and axes.

    A position channel replaces its component of the OFFSET; without a channel the OFFSET stays.
    Those of all joints but the root are added where they are small beside the OFFSETs, with a note.
    The rest pose is the file's OFFSETs with identity rotations.
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
    notes = file.notes
    moving = [
        j for j, joint in enumerate(file.joints) if j and set(CHANNELS[:3]) <= {*joint.channels}
    ]
    mean_length = np.abs(translations[:, moving].mean(axis=0)).sum()
    if mean_length < RELATIVE * np.abs(offsets[moving]).sum():
        translations[:, moving] += offsets[moving]
        notes += (f"positions of {len(moving)} joints are relative to their OFFSETs: added",)
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
        notes=notes,
    )


def to_clip(file: BvhFile, *, metres_per_unit: float, up: UpAxis, root_offset: RootOffset) -> Clip:
    """Return the file's motion in metres with Y up, as `motion_file.to_clip`."""
    return motion_files.to_clip(
        motion_file(file), metres_per_unit=metres_per_unit, up=up, root_offset=root_offset
    )
