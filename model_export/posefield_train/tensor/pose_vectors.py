"""Pose vectors: root translation and the numbers of each joint's rotation about its mean.

The numbers are those of a chart of rotations (`quat`). Rotations are ambiguous beyond
half a turn from the mean, which a raised arm can reach: they are unwrapped so that no clip is
discontinuous, and every such joint is reported.
"""

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from posefield.common.errors import TrainingError
from posefield.common.units import (
    Booleans,
    ClipPaths,
    ClipPositions,
    ClipRotations,
    Floats,
    JointRotations,
    RootPath,
    Vector,
)
from posefield.motion import quat
from posefield.motion.quat import CHARTS, ChartName
from posefield.motion.skeleton import POSES_PER_BLOCK
from posefield_train.source import canonical
from posefield_train.source.canonical import Finding

# Angle from the mean, rad, above which a joint is reported: rotation vectors become ambiguous at π.
REPORTED_ANGLE = 0.9 * np.pi
FARTHEST = 1.5 * np.pi
"""Angle from the mean, rad, above which rotation vectors are used.

The stereographic numbers of larger angles grow fast, and those of a whole turn are infinite.
"""


@dataclass(frozen=True)
class PoseChart:
    """Chart of poses. means: rotations (J, 4) about which rotations are taken, in a chart."""

    means: JointRotations
    chart: ChartName

    @property
    def joint_numbers(self) -> slice:
        """Return the place of the rotations in a pose vector."""
        return slice(3, 3 + 3 * len(self.means))

    @property
    def curve_numbers(self) -> slice:
        """Return the place of the curves in a pose vector."""
        return slice(3 + 3 * len(self.means), None)

    def numbers(
        self, rotations: ClipRotations, root_path: ClipPaths
    ) -> Annotated[Floats, "clips frames 3+joints*3"]:
        """Return pose vectors (N, T, 3 + 3 J) of rotations (N, T, J, 4), root paths (N, T, 3).

        Raises TrainingError for a rotation beyond the chart's limit.
        """
        numbers = np.empty((*root_path.shape[:2], self.joint_numbers.stop))
        numbers[..., :3] = root_path
        for rows in canonical.clip_blocks(len(rotations)):
            vectors = _unwrap(self.rotation_vectors(rotations[rows]))
            self._check_angles(vectors)
            joint_values = CHARTS[self.chart].numbers(vectors)
            numbers[rows, :, self.joint_numbers] = joint_values.reshape(*joint_values.shape[:2], -1)
        return numbers

    def poses(
        self, numbers: Annotated[Floats, "*poses dof"]
    ) -> tuple[Annotated[Floats, "*poses joints 4"], Annotated[Floats, "*poses 3"]]:
        """Return rotations (..., J, 4), root positions (..., 3) of pose vectors (..., D).

        Numbers beyond 3 + 3 J are those of curves.
        """
        *lead, freedoms = numbers.shape
        rows = numbers.reshape(-1, freedoms)
        rotations = np.empty((len(rows), 4 * len(self.means)))
        for start in range(0, len(rows), POSES_PER_BLOCK):
            block = slice(start, start + POSES_PER_BLOCK)
            planes = self.rotation_planes(np.ascontiguousarray(rows[block, self.joint_numbers].T))
            rotations[block] = planes.reshape(rotations.shape[1], -1).T
        return rotations.reshape(*lead, -1, 4), numbers[..., :3]

    def rotation_planes(
        self, vectors: Annotated[Floats, "numbers *poses"]
    ) -> Annotated[Floats, "joints 4 *poses"]:
        """Return rotations (J, 4, ...) of their numbers (3 J, ...)."""
        planes = vectors.reshape(len(self.means), 3, *vectors.shape[1:]).swapaxes(0, 1)
        rotations = np.empty((len(self.means), 4, *vectors.shape[1:]))
        means = self.means.T.reshape(4, -1, *(1 for _ in vectors.shape[1:]))
        quat.product_planes(means, CHARTS[self.chart].planes(planes), out=rotations.swapaxes(0, 1))
        return rotations

    def far_joints(self, rotations: ClipRotations) -> list[Finding]:
        """Return the joints of rotations (N, T, J, 4) close to half a turn from their means."""
        return [
            finding
            for rows in canonical.clip_blocks(len(rotations))
            for finding in _far_joints(self.rotation_vectors(rotations[rows]), rows.start)
        ]

    def _check_angles(self, vectors: ClipPositions) -> None:
        limit = CHARTS[self.chart].limit
        largest = np.linalg.norm(vectors, axis=-1).max(axis=(0, 1))
        joint = int(largest.argmax())
        if largest[joint] > limit:
            angle, allowed = np.degrees([largest[joint], limit])
            raise TrainingError(
                f"joint {joint} turns {angle:.0f} degrees from its mean rotation, expected at most "
                f"{allowed:.0f} in the {self.chart} chart of this model"
            )

    def rotation_vectors(self, rotations: ClipRotations) -> ClipPositions:
        """Return the rotation vectors (N, T, J, 3), rad, of at most half a turn from the means."""
        return quat.log(quat.mul(quat.conj(self.means), rotations))


def fit_chart(rotations: ClipRotations, linear: bool = False) -> tuple[PoseChart, list[Finding]]:
    """Return the chart about the chordal means of rotations (N, T, J, 4), and far joints.

    It is stereographic unless a rotation lies farther than FARTHEST from its mean, or is to be
    linear in the angle of a hinge.
    """
    plain = PoseChart(quat.mean(rotations.reshape(-1, *rotations.shape[2:])), "rotation_vector")
    farthest, far = 0.0, []
    for rows in canonical.clip_blocks(len(rotations)):
        vectors = plain.rotation_vectors(rotations[rows])
        far += _far_joints(vectors, rows.start)
        farthest = max(farthest, float(np.linalg.norm(_unwrap(vectors), axis=-1).max()))
    return plain if linear or farthest > FARTHEST else replace(plain, chart="stereographic"), far


def _jumps(vectors: ClipPositions) -> Annotated[Booleans, "clips joints"]:
    """Return a mask (N, J) of rotation vectors with a jump of over half a turn between frames."""
    steps = np.linalg.norm(np.diff(vectors, axis=1), axis=-1)
    jumps: Booleans = np.any(steps > np.pi, axis=1)
    return jumps


def _far_joints(vectors: ClipPositions, first: int) -> list[Finding]:
    """Return the far joints of rotation vectors (N, T, J, 3); first: number of the first clip."""
    largest = np.linalg.norm(vectors, axis=-1).max(axis=1)
    jumps = _jumps(vectors)
    return [
        Finding(
            "wrap" if jumps[clip, joint] else "far", int(joint), first + int(clip), float(angle)
        )
        for (clip, joint), angle in np.ndenumerate(largest)
        if angle > REPORTED_ANGLE
    ]


def _unwrap(vectors: ClipPositions) -> ClipPositions:
    vectors = vectors.copy()
    for clip, joint in np.argwhere(_jumps(vectors)):
        vectors[clip, :, joint] = _unwrap_path(vectors[clip, :, joint])
    return vectors


def _unwrap_path(path: RootPath) -> RootPath:
    """Unwrap rotation vectors (T, 3) in both directions from the frame nearest to the mean.

    Starting at that frame puts all clips on the same branch.
    """
    path = path.copy()
    start = int(np.argmin(np.linalg.norm(path, axis=-1)))
    for frame in range(start + 1, len(path)):
        path[frame] = _nearest_turn(path[frame], path[frame - 1])
    for frame in range(start - 1, -1, -1):
        path[frame] = _nearest_turn(path[frame], path[frame + 1])
    return path


def _nearest_turn(vector: Vector, neighbour: Vector) -> Vector:
    """Return the same rotation with whole turns added so that it lies nearest to a neighbour."""
    angle = float(np.linalg.norm(vector))
    if angle < 1e-9:
        return vector
    axis = vector / angle
    turns = np.rint((neighbour @ axis - angle) / (2.0 * np.pi))
    return (angle + 2.0 * np.pi * turns) * axis
