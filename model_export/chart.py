"""Poses as numbers: root translation and rotation vectors about each joint's mean rotation.

An arm that is raised can pass half a turn from its mean. There rotation vectors are ambiguous: they
are followed past half a turn, so that no clip jumps, and every such joint is reported.
"""

from dataclasses import dataclass

import numpy as np

from model_export.flips import Finding
from service.motion import quat
from service.motion.conventions import Floats

# From here on a joint is named: close to where rotation vectors become ambiguous, rad.
FAR = 0.9 * np.pi


@dataclass(frozen=True)
class Chart:
    """Means (J, 4) about which rotation vectors are taken."""

    means: Floats

    def numbers(self, rotations: Floats, root_path: Floats) -> Floats:
        """Pose vectors (N, T, 3 + 3 J) of rotations (N, T, J, 4) and root paths (N, T, 3)."""
        vectors = _unwrapped(quat.log(quat.mul(quat.conj(self.means), rotations)))
        return np.concatenate([root_path, vectors.reshape(*root_path.shape[:2], -1)], axis=-1)

    def poses(self, numbers: Floats) -> tuple[Floats, Floats]:
        """Rotations (..., J, 4) and root positions (..., 3) of pose vectors (..., 3 + 3 J)."""
        vectors = numbers[..., 3:].reshape(*numbers.shape[:-1], -1, 3)
        return quat.mul(self.means, quat.exp(vectors)), numbers[..., :3]

    def far(self, rotations: Floats) -> list[Finding]:
        """Joints of rotations (N, T, J, 4) that come close to half a turn from their means."""
        return _far(quat.log(quat.mul(quat.conj(self.means), rotations)))


def fit(rotations: Floats) -> tuple[Chart, list[Finding]]:
    """Chart about the chordal means of rotations (N, T, J, 4), and what is far from them."""
    own_chart = Chart(quat.mean(rotations.reshape(-1, *rotations.shape[2:])))
    return own_chart, own_chart.far(rotations)


def _jumps(vectors: Floats) -> Floats:
    """Which (N, J) rotation vectors jump by more than half a turn between neighbours."""
    steps = np.linalg.norm(np.diff(vectors, axis=1), axis=-1)
    jumps: Floats = np.any(steps > np.pi, axis=1)
    return jumps


def _far(vectors: Floats) -> list[Finding]:
    largest = np.linalg.norm(vectors, axis=-1).max(axis=1)
    jumps = _jumps(vectors)
    return [
        Finding("wrap" if jumps[clip, joint] else "far", int(joint), int(clip), float(angle))
        for (clip, joint), angle in np.ndenumerate(largest)
        if angle > FAR
    ]


def _unwrapped(vectors: Floats) -> Floats:
    vectors = vectors.copy()
    for clip, joint in np.argwhere(_jumps(vectors)):
        vectors[clip, :, joint] = _followed(vectors[clip, :, joint])
    return vectors


def _followed(path: Floats) -> Floats:
    """Rotation vectors (T, 3) that run on from where they are shortest, in both directions.

    Starting where a clip is nearest to the mean puts all clips on one sheet.
    """
    path = path.copy()
    start = int(np.argmin(np.linalg.norm(path, axis=-1)))
    for frame in range(start + 1, len(path)):
        path[frame] = _nearest_turn(path[frame], path[frame - 1])
    for frame in range(start - 1, -1, -1):
        path[frame] = _nearest_turn(path[frame], path[frame + 1])
    return path


def _nearest_turn(vector: Floats, neighbour: Floats) -> Floats:
    """The same rotation with whole turns added so that it lies nearest to a neighbour."""
    angle = float(np.linalg.norm(vector))
    if angle < 1e-9:
        return vector
    axis = vector / angle
    turns = np.rint((neighbour @ axis - angle) / (2.0 * np.pi))
    return (angle + 2.0 * np.pi * turns) * axis
