"""Reader of BVH files; errors name the line."""

import io
import re
from functools import lru_cache
from typing import IO, Literal, Protocol

from posefield.common.errors import BvhError
from posefield_train.source.bvh.bvh_content import BvhFile, BvhJoint, Vector, decode
from posefield_train.source.bvh.bvh_hierarchy import HierarchyReader
from posefield_train.source.bvh.bvh_motion import MotionReader
from posefield_train.source.bvh.bvh_text import BLOCK, TextCursor
from posefield_train.source.bvh.bvh_tokens import TokenCursor
from posefield_train.source.motion_files.frame_rate import snapped_rate

# A joint can be named MOTION_head, so the section begins at a line of the keyword alone.
MOTION_LINE = re.compile(r"^[ \t]*MOTION[ \t]*$", re.MULTILINE | re.IGNORECASE)

MAX_HEADER = 4_000_000
"""Limit of characters before the line MOTION: several times the length of MOST_JOINTS joints."""

MAX_POSES = 10_000_000
"""Limit of frames times joints: 45 minutes of 31 joints at 120 frames a second, 0.6 GB as a clip.

Joints without channels add nothing to the MOTION section, so the file's size does not limit them.
"""


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

    At most the numbers of MOST_POSES and a few megabytes are kept in memory, whatever the file's
    size. Raises BvhError for a violation of the grammar or an inconsistency.
    """
    text = TextCursor(file, source)
    # Read one more block, so that a line that begins before the limit is complete.
    text.fill(MAX_HEADER + BLOCK)
    found = MOTION_LINE.search(text.ahead)
    size = found.start() if found else len(text.ahead)
    end = "MOTION" if found else "the end of the file"
    if size > MAX_HEADER:
        size, end = MAX_HEADER, f"{MAX_HEADER // 1_000_000} MB without a line MOTION"
    joints, tips = _tree(text.take(size), source, end)
    channels = sum(len(joint.channels) for joint in joints)
    if not channels:
        message = f"found no channel in {len(joints)} joints, expected at least one"
        raise BvhError(source, message, text.line)
    text.take_line()
    motion = MotionReader(text, max_values=MAX_POSES // len(joints) * channels)
    frame_time, frames, values = motion.read(channels)
    if frames * len(joints) > MAX_POSES:
        message = f"found {frames} frames of {len(joints)} joints, expected at most"
        raise BvhError(source, f"{message} {MAX_POSES} poses of a joint", text.line)
    return BvhFile(source, joints, tips, values, frame_time, snapped_rate(frame_time))


_Tree = tuple[tuple[BvhJoint, ...], tuple[tuple[int, Vector], ...]]


def _tree(head: str, source: str, end: str) -> _Tree:
    """Return the joints and end sites of the text before MOTION; `end` names the text after it."""
    try:
        return _parse_tree(head, end)
    except BvhError as fault:
        raise BvhError(source, fault.message, fault.line) from None


@lru_cache(maxsize=16)
def _parse_tree(head: str, end: str) -> _Tree:
    # Cached, because all takes of one performer have the same hierarchy.
    hierarchy = HierarchyReader(TokenCursor(decode(head.encode("latin-1")), "", end))
    hierarchy.read()
    return hierarchy.joints(), tuple(hierarchy.tips)
