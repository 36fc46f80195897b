"""Content of a BVH file as written, without interpretation of unit, up axis or root offset."""

import re
from dataclasses import dataclass

from posefield.common.units import Floats

CHANNELS = ("Xposition", "Yposition", "Zposition", "Xrotation", "Yrotation", "Zrotation")
NUMBER = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d+)?", re.ASCII)
MAX_NUMBER = 1e9
"""Largest magnitude of a number; larger ones would overflow in products."""

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class BvhJoint:
    """One joint as written.

    parent: index of an earlier joint, -1 for the root. offset: in the file's unit. channels: in the
    order of their columns, spelled as in CHANNELS.
    """

    name: str
    parent: int
    offset: Vector
    channels: tuple[str, ...]

    @property
    def rotation_axes(self) -> str:
        """Return the axes of the rotation channels in order, such as "ZXY"; may be empty."""
        return "".join(name[0] for name in self.channels if name.endswith("rotation"))


@dataclass(frozen=True)
class BvhFile:
    """A file that follows the grammar.

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


def decode(content: bytes) -> str:
    """Decode text as UTF-8, else as cp932 (Japanese tools), else as Latin-1, which never fails."""
    for encoding in ("utf-8-sig", "cp932"):
        try:
            return content.decode(encoding)
        except UnicodeDecodeError:
            continue
    return content.decode("latin-1")


def quote(text: str) -> str:
    """Quote text for a message, cut to 40 characters."""
    return repr(text if len(text) <= 40 else f"{text[:37]}...")
