"""Forward kinematics of one joint, and its gradient with respect to a pose vector.

Only the joints of the chain from the root to this joint are computed.
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from posefield.common.array_shapes import Bones, RootPath, Vector
from posefield.common.units import UP, Floats
from posefield.inference.reduced_motion import ReducedTensor
from posefield.motion import quat
from posefield.motion.rotation_charts import CHARTS, RotationChart


@dataclass(frozen=True)
class JointChain:
    """Chain of C joints from the root to one joint.

    bones: (C, 3), m. rotations: mean rotation matrices (C, 3, 3). mean (3 + 3 C,), directions (r1,
    3 + 3 C): rows of the reduced tensor for the root's position and the chain's rotations. chart:
    of the numbers of rotations.
    """

    bones: Annotated[Floats, "chain 3"]
    rotations: Annotated[Floats, "chain 3 3"]
    mean: Annotated[Floats, "dof"]
    directions: Annotated[Floats, "freedoms dof"]
    chart: RotationChart

    def compute_poses(
        self, moves: Annotated[Floats, "frames freedoms"], gone: RootPath
    ) -> "ChainPoses":
        """Return the chain's poses at coefficients (S, r1) of the first mode.

        gone (S, 3): travel of the root so far: to the left and ahead, m, and turn, rad.
        """
        found = self.mean + moves @ self.directions
        vectors = found[:, 3:].reshape(len(moves), -1, 3)
        turns = self.rotations @ quat.to_matrix(self.chart.quaternions(vectors))
        if gone[:, 2].any():
            turns[:, 0] = quat.to_matrix(quat.from_axis_angle(UP, gone[:, 2])) @ turns[:, 0]
        roots = found[:, :3].copy()
        roots[:, [0, 2]] += gone[:, :2]
        return _forward(self.bones, vectors, turns, roots)

    def gradient(
        self, pose: "ChainPoses", row: int
    ) -> tuple[Annotated[Floats, "3 freedoms"], Vector]:
        """Return the gradients of the last joint's position in one of the poses.

        The first is by the coefficients of the first mode (3, r1), m; the second by the turn of the
        travel (3,), m per radian.
        """
        axes = pose.turned[row] @ self.chart.right_jacobian(pose.vectors[row])
        arms = pose.positions[row, -1] - pose.positions[row]
        moved = quat.cross(np.swapaxes(axes, -1, -2), arms[:, None])
        by_turning = moved.reshape(-1, 3).T @ self.directions[:, 3:].T
        return by_turning + self.directions[:, :3].T, quat.cross(UP, arms[0])


@dataclass(frozen=True)
class ChainPoses:
    """A chain in S poses.

    vectors: numbers (S, C, 3) of the rotations. turned: orientations (S, C, 3, 3). positions: (S,
    C, 3), m.
    """

    vectors: Annotated[Floats, "frames chain 3"]
    turned: Annotated[Floats, "frames chain 3 3"]
    positions: Annotated[Floats, "frames chain 3"]


def chain_to(
    joint: int, parents: tuple[int, ...], bones: Bones, reduced: ReducedTensor
) -> JointChain:
    """Return the chain that ends with a joint; bones (J, 3), m."""
    chain = [joint]
    while chain[0]:
        chain.insert(0, parents[chain[0]])
    numbers = [0, 1, 2, *(3 + 3 * link + axis for link in chain for axis in range(3))]
    mean, directions = reduced.mean[numbers], reduced.directions[:, numbers]
    turns, chart = quat.to_matrix(reduced.rotations[chain]), CHARTS[reduced.chart]
    return JointChain(bones[chain], turns, mean, directions, chart)


def _forward(
    bones: Annotated[Floats, "chain 3"],
    vectors: Annotated[Floats, "frames chain 3"],
    turns: Annotated[Floats, "frames chain 3 3"],
    roots: RootPath,
) -> ChainPoses:
    turned, positions = turns.copy(), np.empty_like(vectors)
    positions[:, 0] = roots
    for link in range(1, len(bones)):
        above = turned[:, link - 1]
        positions[:, link] = positions[:, link - 1] + above @ bones[link]
        turned[:, link] = above @ turns[:, link]
    return ChainPoses(vectors, turned, positions)
