"""A tree of joints and the forward kinematics over it."""

from dataclasses import dataclass

import numpy as np

from service.motion import quat
from service.motion.conventions import Floats


@dataclass(frozen=True)
class Skeleton:
    """Joints parents first, their rest offsets, and the end sites that no joint follows.

    names: one a joint, unique. parents (J,): index of each joint's parent, -1 for the root, which
    comes first; a parent always precedes its children. offsets (J, 3): rest translation from the
    parent, m. tip_joints (E,), tip_offsets (E, 3): the joint that each end site hangs on and how
    far from it, m. In the rest pose every rotation is the identity.
    """

    names: tuple[str, ...]
    parents: tuple[int, ...]
    offsets: Floats
    tip_joints: tuple[int, ...]
    tip_offsets: Floats

    def __post_init__(self) -> None:
        count = len(self.names)
        if not count or len(self.parents) != count or self.offsets.shape != (count, 3):
            raise ValueError(
                f"{count} names, {len(self.parents)} parents, offsets {self.offsets.shape}"
            )
        if len(set(self.names)) != count:
            raise ValueError("joint names must be unique")
        if self.parents[0] != -1 or any(not 0 <= p < j for j, p in self._children()):
            raise ValueError("the root comes first and every parent before its children")
        if self.tip_offsets.shape != (len(self.tip_joints), 3):
            raise ValueError(f"{len(self.tip_joints)} tips, offsets {self.tip_offsets.shape}")

    def _children(self) -> list[tuple[int, int]]:
        return list(enumerate(self.parents))[1:]

    def __len__(self) -> int:
        return len(self.names)

    def at_rest(self, offsets: Floats) -> Floats:
        """Joint positions (..., J, 3) where none turns and offsets lead from the parents, m."""
        positions = offsets.copy()
        for joint, parent in self._children():
            positions[..., joint, :] += positions[..., parent, :]
        return positions

    def same_tree(self, other: "Skeleton") -> bool:
        """Whether both have the same joints in the same places of the tree, of whatever size."""
        return self.names == other.names and self.parents == other.parents


def translations(offsets: Floats, root_path: Floats) -> Floats:
    """Local translations (..., T, J, 3) of bones that keep their offsets (..., J, 3) while the root
    follows its path (..., T, 3)."""
    local = np.empty((*root_path.shape[:-1], *offsets.shape[-2:]))
    local[:] = offsets[..., None, :, :]
    local[..., 0, :] = root_path
    return local


def forward(
    parents: tuple[int, ...], rotations: Floats, translations: Floats
) -> tuple[Floats, Floats]:
    """Joint positions (..., J, 3) and orientations (..., J, 4) in the character's frame.

    rotations (..., J, 4) and translations (..., J, 3) are local to the parent and broadcast
    against each other.
    """
    lead = np.broadcast_shapes(rotations.shape[:-2], translations.shape[:-2])
    positions = np.empty((*lead, len(parents), 3))
    orientations = np.empty((*lead, len(parents), 4))
    positions[..., 0, :], orientations[..., 0, :] = translations[..., 0, :], rotations[..., 0, :]
    for joint, parent in enumerate(parents[1:], start=1):
        turn = orientations[..., parent, :]
        arm = quat.rotate(turn, translations[..., joint, :])
        positions[..., joint, :] = positions[..., parent, :] + arm
        orientations[..., joint, :] = quat.mul(turn, rotations[..., joint, :])
    return positions, orientations


def descendants(parents: tuple[int, ...]) -> Floats:
    """Matrix (J, J) with 1 where the column's joint is the row's joint or hangs below it."""
    below = np.eye(len(parents))
    for joint in range(len(parents) - 1, 0, -1):
        below[parents[joint]] += below[joint]
    return below
