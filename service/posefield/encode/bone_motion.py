"""Bones of a crowd in the world: positions, orientations and velocities of each character.

Velocities are central differences of the frames, and one-sided ones at the first and last frame, so
that differences of the positions in a file are the velocities in it.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from posefield.common.units import Bones, Floats, Frames, Indices, Positions, RootPath, Rotations
from posefield.motion import quat, skeleton
from posefield.motion.clip import CrowdClip
from posefield.motion.skeleton import Skeleton


@dataclass(frozen=True)
class BoneMotion:
    """Motion of one character in the frames in which it is there.

    index: of the character. first: its first frame on the crowd's clock. rotations (F, J, 4): local
    to the parent, the root's in the world. roots (F, 3): root positions in the world, m.
    offsets (J, 3): of the bones, m.
    """

    index: int
    first: int
    skeleton: Skeleton
    rotations: Rotations
    roots: RootPath
    offsets: Bones
    rate: float

    def __len__(self) -> int:
        return len(self.roots)

    def world(self, frames: slice = slice(None)) -> tuple[Positions, Rotations]:
        """Return positions (F, J, 3), m, and orientations (F, J, 4) of joints in the world."""
        local = skeleton.translations(self.offsets, self.roots[frames])
        return skeleton.forward_kinematics(self.skeleton.parents, self.rotations[frames], local)


def character_motions(crowd: CrowdClip) -> Iterator[BoneMotion]:
    """Yield the motions of the characters, in the order of the motions that they play."""
    turns, positions = crowd.placement.turns, crowd.placement.positions
    players = np.argsort(crowd.motion, kind="stable")
    limits = np.searchsorted(crowd.motion[players], np.arange(crowd.motion.max() + 2))
    number = 0
    for batch in crowd.batches:
        for row in range(len(batch)):
            for character in players[limits[number] : limits[number + 1]].tolist():
                first, end = presence(crowd)[character].tolist()
                rotations = batch.rotations[row, first:end].astype(np.float64)
                roots = batch.root_position[row, first:end].astype(np.float64)
                rotations[:, 0] = quat.mul(turns[character], rotations[:, 0])
                yield BoneMotion(
                    character,
                    first,
                    crowd.skeleton,
                    rotations,
                    quat.rotate(turns[character], roots) + positions[character],
                    batch.bone_offsets[row].astype(np.float64),
                    crowd.rate,
                )
            number += 1


def presence(crowd: CrowdClip) -> Annotated[Indices, "characters 2"]:
    """Return the first frame in which each character is there, and the one after the last."""
    if crowd.presence is not None:
        return crowd.presence
    return np.tile([0, crowd.frames], (len(crowd.motion), 1))


def people(crowd: CrowdClip) -> list[str]:
    """Return the ids of the characters: those of their tracks, or their numbers from 0."""
    return list(crowd.facts.get("people", map(str, range(len(crowd.motion)))))


def frame_times(crowd: CrowdClip) -> Frames:
    """Return the times of the frames (F,), s: those of the tracks, or from 0."""
    return float(crowd.facts.get("begin", 0.0)) + np.arange(crowd.frames) / crowd.rate


def differences(values: Annotated[Floats, "frames *rows"], rate: float) -> Floats:
    """Return the rates of change (F, ...) of values, a second; zero for one frame."""
    changes = np.zeros_like(values)
    if len(values) > 1:
        changes[1:-1] = (values[2:] - values[:-2]) * (0.5 * rate)
        changes[0], changes[-1] = (values[1] - values[0]) * rate, (values[-1] - values[-2]) * rate
    return changes


def angular_velocities(
    turns: Annotated[Floats, "frames *rows 4"], rate: float
) -> Annotated[Floats, "frames *rows 3"]:
    """Return angular velocities (F, ..., 3), rad/s, about the axes of the parent's frame."""
    planes = np.moveaxis(turns, -1, 0)
    back, steps = quat.conj(turns), np.zeros_like(planes)
    steps[0] = 1.0
    seconds = np.full(len(turns), 2.0 / rate)
    seconds[[0, -1]] = 1.0 / rate
    if len(turns) > 1:
        for at, after, before in ((np.s_[1:-1], np.s_[2:], np.s_[:-2]), (0, 1, 0), (-1, -1, -2)):
            earlier = np.moveaxis(back[before], -1, 0)
            quat.product_planes(planes[:, after], earlier, steps[:, at])
    turned = quat.log(np.moveaxis(steps, 0, -1))
    return turned / seconds.reshape(-1, *[1] * (turns.ndim - 1))
