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
    """A chain of joints from the root to one, with their bones (C, 3), m, and what the reduced
    tensor says of them.

    rotations (C, 3, 3): mean ones. mean (3 + 3 C,), directions (r1, 3 + 3 C): of the root's
    position and the chain's rotation vectors.
    """

    bones: Floats
    rotations: Floats
    mean: Floats
    directions: Floats

    def posed(self, moves: Floats, gone: Floats) -> "Pose":
        """The chain at coefficients (S, r1) of the first mode, where the root has got gone (S, 3)
        of a cycle's travel: to the left and ahead, m, and turned, rad."""
        found = self.mean + moves @ self.directions
        vectors = found[:, 3:].reshape(len(moves), -1, 3)
        turns = self.rotations @ quat.to_matrix(quat.exp(vectors))
        if gone[:, 2].any():
            turns[:, 0] = quat.to_matrix(quat.about(UP, gone[:, 2])) @ turns[:, 0]
        roots = found[:, :3].copy()
        roots[:, [0, 2]] += gone[:, :2]
        return _forward(self.bones, vectors, turns, roots)

    def gradient(self, pose: "Pose", row: int) -> tuple[Floats, Floats]:
        """How the last joint moves with the coefficients of the first mode (3, r1), m, and with the
        turn of the travel (3,), m for a radian, in one of the poses."""
        axes = pose.turned[row] @ quat.right_jacobian(pose.vectors[row])
        arms = pose.positions[row, -1] - pose.positions[row]
        moved = quat.cross(np.swapaxes(axes, -1, -2), arms[:, None])
        by_turning = moved.reshape(-1, 3).T @ self.directions[:, 3:].T
        return by_turning + self.directions[:, :3].T, quat.cross(UP, arms[0])


@dataclass(frozen=True)
class Pose:
    """A chain in S poses: rotation vectors (S, C, 3), orientations (S, C, 3, 3), positions
    (S, C, 3)."""

    vectors: Floats
    turned: Floats
    positions: Floats


def to(joint: int, parents: tuple[int, ...], bones: Floats, reduced: Reduced) -> Limb:
    """The limb that ends with a joint; bones (J, 3), m."""
    chain = [joint]
    while chain[0]:
        chain.insert(0, parents[chain[0]])
    numbers = [0, 1, 2, *(3 + 3 * link + axis for link in chain for axis in range(3))]
    mean, directions = reduced.mean[numbers], reduced.directions[:, numbers]
    return Limb(bones[chain], quat.to_matrix(reduced.rotations[chain]), mean, directions)


def _forward(bones: Floats, vectors: Floats, turns: Floats, roots: Floats) -> Pose:
    turned, positions = turns.copy(), np.empty_like(vectors)
    positions[:, 0] = roots
    for link in range(1, len(bones)):
        above = turned[:, link - 1]
        positions[:, link] = positions[:, link - 1] + above @ bones[link]
        turned[:, link] = above @ turns[:, link]
    return Pose(vectors, turned, positions)
