"""Many characters of one skeleton: where each stands, and what all of them do."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from service.motion import quat
from service.motion.conventions import UP, Floats, Indices, Singles, Truths
from service.motion.skeleton import Skeleton


@dataclass(frozen=True)
class Placement:
    """Where each character's own frame stands: positions (N, 3), m, and headings (N,), rad.

    A heading turns the frame about +Y: a character that faces +Z in its own frame faces +X at a
    heading of a quarter turn.
    """

    positions: Floats
    headings: Floats

    def __len__(self) -> int:
        return len(self.headings)

    @property
    def turns(self) -> Floats:
        """Quaternions (N, 4) of the headings."""
        return quat.about(UP, self.headings)


@dataclass(frozen=True)
class Motions:
    """Motions of equal length in their characters' own frames.

    rotations (M, F, J, 4) and root_position (M, F, 3), m; bone_offsets (M, J, 3), m. levels (M, F):
    level of detail that each pose was made at.
    """

    rotations: Singles
    root_position: Singles
    bone_offsets: Singles
    levels: Indices

    def __len__(self) -> int:
        return len(self.rotations)


@dataclass(frozen=True)
class CrowdPoses:
    """One pose of each of N characters, where each stands in the world.

    model: name@contenthash. rotations (N, J, 4), the root's in the world; root_position (N, 3), m,
    in the world; bone_offsets (N, J, 3), m. levels (N,): level of detail of each. error_px (N,):
    pixels that the level's error covers; none where no camera was given. duration (N,), s: of each
    character's clip. sigma (N,), m, and supported (N,): as in Trust. warnings: sentences
    on the crowd as a whole.
    """

    model: str
    skeleton: Skeleton
    rotations: Singles
    root_position: Singles
    bone_offsets: Singles
    levels: Indices
    error_px: Singles | None
    duration: Singles
    sigma: Singles
    supported: Truths
    warnings: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.rotations)


@dataclass(frozen=True)
class CrowdClip:
    """A moving crowd: N characters that play M motions of so many frames at a rate.

    motion (N,): which motion each character plays. batches: the motions in order, some at a time,
    made as they are asked for, so that a crowd need never be held whole; it is gone through once.
    facts: where it comes from, as plain values.
    """

    skeleton: Skeleton
    rate: float
    frames: int
    placement: Placement
    motion: Indices
    batches: Iterable[Motions]
    facts: Mapping[str, Any]

    @property
    def shared(self) -> bool:
        """Whether some motion is played by more than one character."""
        return len(np.unique(self.motion)) < len(self.motion)
