"""Content of a motion file of any format, in the file's own unit and axes."""

from dataclasses import dataclass

from posefield.common.array_shapes import Positions, Rotations
from posefield.common.errors import MotionFileError
from posefield.common.units import UpAxis
from posefield.motion.skeleton import Skeleton

Vector = tuple[float, float, float]
ORIGIN: Vector = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class MotionFile:
    """One motion of one skeleton as a file holds it.

    source: the file's name, for messages. format: such as "BVH". skeleton: at rest with identity
    rotations. rotations (F, J, 4), translations (F, J, 3): local to the parent. rate: frames a
    second; None if neither file nor recipe states it. evidence: how the rate is known.
    metres_per_unit, up: as the file states them; None if it does not. added_offset: what
    source.root_offset = "add" adds to the root's path; zero for other formats than BVH. notes: on
    what the reader assumed.
    """

    source: str
    format: str
    skeleton: Skeleton
    rotations: Rotations
    translations: Positions
    rate: float | None
    evidence: str
    metres_per_unit: float | None = None
    up: UpAxis | None = None
    added_offset: Vector = ORIGIN
    notes: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.rotations)

    @property
    def poses(self) -> int:
        """Return the number of frames times joints."""
        return len(self) * len(self.skeleton)

    def error(self, message: str) -> MotionFileError:
        """Return an error that names this file."""
        return MotionFileError(self.source, message)


@dataclass(frozen=True)
class ReadOptions:
    """Settings of a recipe for reading a file; None for those that it does not have.

    rate: source.rate, frames a second. animation: name of one of several in the file.
    """

    rate: float | None = None
    animation: str | None = None


AS_STATED = ReadOptions()
"""Nothing told: a file is read by what it states."""
