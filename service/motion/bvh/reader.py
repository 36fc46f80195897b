"""Bytes of a BVH file to what they say, or a BvhError that names the line."""

import re
from typing import Protocol

from service.motion.bvh.grammar import BvhFile
from service.motion.bvh.hierarchy import Hierarchy
from service.motion.bvh.motion import Motion, snapped_rate
from service.motion.bvh.tokens import Tokens
from service.motion.errors import BvhError

# A joint may be called MOTION_head, so only a line that is the keyword begins the section.
MOTION_LINE = re.compile(r"^[ \t]*MOTION[ \t]*$", re.MULTILINE | re.IGNORECASE)

MOST_POSES = 10_000_000
"""Frames times joints: 45 minutes of 31 joints at 120 frames a second, 0.6 GB as a clip.

A joint without channels costs a file nothing, so that its size is no bound.
"""


class Readable(Protocol):
    """A pathlib.Path, a zipfile.Path, or the like."""

    def read_bytes(self) -> bytes:
        """Everything that the file holds."""


def read(path: Readable) -> BvhFile:
    """The file at `path`; BvhError where it cannot be read, and as `loads`."""
    try:
        content = path.read_bytes()
    except OSError as fault:
        raise BvhError(str(path), f"cannot be read: {fault.strerror}") from fault
    return loads(content, str(path))


def loads(content: bytes, source: str) -> BvhFile:
    """The file that `content` holds; `source` names it in messages.

    Raises BvhError for whatever breaks the grammar or contradicts itself.
    """
    # Only line feeds end a line: str.splitlines would also part names at a form feed or U+0085.
    text = decode(content).replace("\r\n", "\n").replace("\r", "\n")
    found = MOTION_LINE.search(text)
    head, data = (text[: found.start()], text[found.end() + 1 :]) if found else (text, "")
    hierarchy = Hierarchy(Tokens(head, source, "MOTION" if found else "the end of the file"))
    hierarchy.read()
    joints = hierarchy.joints()
    line = head.count("\n") + 1
    motion = Motion(source, data.split("\n"), line + 1)
    channels = sum(len(joint.channels) for joint in joints)
    if not channels:
        message = f"found no channel in {len(joints)} joints, expected at least one"
        raise BvhError(source, message, line)
    frame_time, values = motion.read(channels)
    if len(values) * len(joints) > MOST_POSES:
        message = f"found {len(values)} frames of {len(joints)} joints, expected at most"
        raise BvhError(source, f"{message} {MOST_POSES} poses of a joint", line)
    return BvhFile(
        source, joints, tuple(hierarchy.tips), values, frame_time, snapped_rate(frame_time)
    )


def decode(content: bytes) -> str:
    """Text in UTF-8, else in the cp932 of Japanese tools, else in Latin-1, which never fails."""
    for encoding in ("utf-8-sig", "cp932"):
        try:
            return content.decode(encoding)
        except UnicodeDecodeError:
            continue
    return content.decode("latin-1")
