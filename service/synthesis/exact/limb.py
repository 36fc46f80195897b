"""Where one joint is, and how it moves with the numbers of a pose vector.

Only the joints that it hangs on are ever posed.
"""

from dataclasses import dataclass

import numpy as np

from service.motion import quat
from service.motion.conventions import UP, Floats
from service.synthesis.exact.reduced import Reduced


@dataclass(frozen=True)
class Limb:
    """A chain of joints from the root to one, with their bones (C, 3), m."""

    chain: tuple[int, ...]
    bones: Floats
    reduced: Reduced

    def posed(self, moves: Floats, gone: Floats) -> "Pose":
        """The chain at coefficients (S, r1) of the first mode, where the root has got gone (S, 3)
        of a cycle's travel: to the left and ahead, m, and turned, rad."""
        joints, reduced = list(self.chain), self.reduced
        numbers = [0, 1, 2, *(3 + 3 * joint + axis for joint in joints for axis in range(3))]
        found = reduced.mean[numbers] + moves @ reduced.directions[:, numbers]
        vectors = found[:, 3:].reshape(len(moves), len(joints), 3)
        turns = quat.mul(reduced.rotations[joints], quat.exp(vectors))
        turns[:, 0] = quat.mul(quat.about(UP, gone[:, 2]), turns[:, 0])
        roots = found[:, :3] + gone[:, :1] * np.array([1.0, 0.0, 0.0])
        roots[:, 2] += gone[:, 1]
        return _forward(self, vectors, turns, roots)

    def gradient(self, pose: "Pose", row: int) -> tuple[Floats, Floats]:
        """How the last joint moves with the coefficients of the first mode (3, r1), m, and with the
        turn of the travel (3,), m for a radian, in one of the poses."""
        axes = quat.to_matrix(pose.turned[row]) @ quat.right_jacobian(pose.vectors[row])
        arms = pose.positions[row, -1] - pose.positions[row]
        moved = quat.cross(np.swapaxes(axes, -1, -2), arms[:, None])
        joints = np.array(self.chain)
        numbers = (3 + 3 * joints[:, None] + np.arange(3)).ravel()
        directions = self.reduced.directions
        by_turning = moved.reshape(-1, 3).T @ directions[:, numbers].T
        return by_turning + directions[:, :3].T, quat.cross(UP, arms[0])


@dataclass(frozen=True)
class Pose:
    """A chain in S poses: rotation vectors (S, C, 3), orientations (S, C, 4), positions
    (S, C, 3)."""

    vectors: Floats
    turned: Floats
    positions: Floats


def to(joint: int, parents: tuple[int, ...], bones: Floats, reduced: Reduced) -> Limb:
    """The limb that ends with a joint; bones (J, 3), m."""
    chain = [joint]
    while chain[0]:
        chain.insert(0, parents[chain[0]])
    return Limb(tuple(chain), bones[chain], reduced)


def _forward(limb: Limb, vectors: Floats, turns: Floats, roots: Floats) -> Pose:
    turned, positions = np.empty_like(turns), np.empty_like(vectors)
    turned[:, 0], positions[:, 0] = turns[:, 0], roots
    for link in range(1, len(limb.chain)):
        above = turned[:, link - 1]
        positions[:, link] = positions[:, link - 1] + quat.rotate(above, limb.bones[link])
        turned[:, link] = quat.mul(above, turns[:, link])
    return Pose(vectors, turned, positions)
