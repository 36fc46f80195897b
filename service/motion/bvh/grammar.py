"""What a BVH file says, before anyone has decided its unit, its up axis or its root offset."""

import re
from dataclasses import dataclass

from service.motion.conventions import Floats

CHANNELS = ("Xposition", "Yposition", "Zposition", "Xrotation", "Yrotation", "Zrotation")
NUMBER = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d+)?", re.ASCII)
WORD = re.compile(r"[^\s{}]+", re.ASCII)
"""ASCII blanks part words: the ideographic space of a Japanese name belongs to the name."""

LARGEST = 1e9
"""No length in any unit and no angle needs more; past it products overflow."""

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class BvhJoint:
    """One joint as written: `offset` in the file's unit, `channels` in the order of their columns.

    parent: index of an earlier joint, -1 for the root. channels: spelled as in CHANNELS.
    """

    name: str
    parent: int
    offset: Vector
    channels: tuple[str, ...]

    @property
    def rotation_axes(self) -> str:
        """Axes of the rotation channels in their order, such as "ZXY"; empty without any."""
        return "".join(name[0] for name in self.channels if name.endswith("rotation"))


@dataclass(frozen=True)
class BvhFile:
    """A file that kept the grammar.

    source: where it came from, for messages. joints: in file order, parents first. tips: the joint
    index and offset of every End Site. values (F, C): a row a frame, a column a channel, the
    joints' channels one after another, in degrees and the file's unit. frame_time: seconds, as
    written. rate: frames a second that the frame time stands for.
    """

    source: str
    joints: tuple[BvhJoint, ...]
    tips: tuple[tuple[int, Vector], ...]
    values: Floats
    frame_time: float
    rate: float


def brief(text: str) -> str:
    """Quoted text, cut to what a message can hold."""
    return repr(text if len(text) <= 40 else f"{text[:37]}...")
