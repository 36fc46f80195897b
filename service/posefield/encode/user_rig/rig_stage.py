"""Place of a skeleton in a user's USD file, as a layer that refers to it needs, in metres."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from posefield.common.units import Floats, JointWeights, Positions, Rotations
from posefield.motion import quat
from posefield.rigs.rest_joints import WORLD, RestJoints


def in_metres(rest: RestJoints) -> RestJoints:
    """Return the joints with the same axes in a world of metres with Y up, without scales."""
    joints, parents = rest.skeleton, list(rest.parents[1:])
    above = np.concatenate([quat.IDENTITY[None], rest.orientations[parents]])
    return RestJoints(
        rest.source,
        rest.names,
        rest.parents,
        quat.normalize(quat.mul(quat.conj(above), rest.orientations)),
        quat.rotate(quat.conj(above), joints.offsets),
        np.ones((len(rest.names), 3)),
        WORLD,
        1.0,
        "y",
    )


def matrices(
    rotations: Annotated[Floats, "*batch joints 4"],
    translations: Annotated[Floats, "*batch joints 3"],
) -> Annotated[Floats, "*batch joints 4 4"]:
    """Return matrices (..., 4, 4) for row vectors, as in USD."""
    stacked = np.zeros((*rotations.shape[:-1], 4, 4))
    stacked[..., :3, :3] = np.swapaxes(quat.to_matrix(rotations), -1, -2)
    stacked[..., 3, :3] = translations
    stacked[..., 3, 3] = 1.0
    return stacked


BLOCK = 256
"""Frames whose matrices are computed together: those of a long motion take gigabytes."""


@dataclass(frozen=True, eq=False)
class RigStage:
    """Place of a skeleton in a USD file.

    skeleton, skel_root: paths of prims. animation: free path for the animation. joints: tokens in
    the order of the rig. to_root (4, 4): for row vectors, from the space of the skeleton to that of
    the SkelRoot. radii (J,): largest distance of a point from a joint that moves it, in the space
    of the skeleton. notes: on what a reference to the root prim lacks.
    """

    skeleton: str
    skel_root: str
    animation: str
    joints: tuple[str, ...]
    to_root: Floats
    radii: JointWeights
    notes: tuple[str, ...] = ()

    @property
    def root(self) -> str:
        """Return the name of the root prim, to which layers refer."""
        return self.skeleton.split("/")[1]

    def extent(self, rest: RestJoints, rotations: Rotations, translations: Positions) -> Floats:
        """Return the lowest and highest corner (2, 3) of the character in the space of its root.

        rotations (F, J, 4), translations (F, J, 3): of the file's joints. A skinned point is a mean
        of points, each as far from a joint as at rest, so it lies within spheres about the joints.
        """
        corners = [
            self._box(rest, rotations[first : first + BLOCK], translations[first : first + BLOCK])
            for first in range(0, len(rotations), BLOCK)
        ]
        low, high = np.stack(corners, axis=1)
        return np.stack([low.min(axis=0), high.max(axis=0)])

    def _box(self, rest: RestJoints, rotations: Rotations, translations: Positions) -> Floats:
        placed = np.zeros((len(rotations), len(rest.names), 4, 4))
        local = matrices(rotations, translations)
        local[..., :3, :3] *= rest.scales[:, :, None]
        for joint, parent in enumerate(rest.parents):
            joint_matrices = local[:, joint]
            placed[:, joint] = joint_matrices @ (self.to_root if parent < 0 else placed[:, parent])
        sizes = np.linalg.norm(self.to_root[:3, :3], axis=1).max()
        origins, reach = placed[..., 3, :3], (sizes * self.radii)[:, None]
        return np.stack([(origins - reach).min(axis=(0, 1)), (origins + reach).max(axis=(0, 1))])
