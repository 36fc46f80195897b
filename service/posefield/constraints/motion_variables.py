"""A motion as a vector of variables for the correction, and its forward kinematics."""

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

import numpy as np

from posefield.common.units import (
    UP,
    Bones,
    Floats,
    Frames,
    ReducedMotions,
    RootPath,
    Variables,
    Vector,
)
from posefield.inference.reduced_motion import ReducedTensor
from posefield.motion import quat
from posefield.motion.quat import CHARTS, RotationChart


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


CYCLE_VARIABLES = 4
"""Variables of a cycle in addition to the reduced motion: logarithm of the duration; travel to the
left and ahead, m; change of heading, rad.
"""


@dataclass(frozen=True)
class MotionVariables:
    """Skeleton and model level of a motion.

    reduced: reduced tensor. parents: of the joints. bones: (J, 3), m. cyclic: true for cycles,
    which have a travel. predicted: variables of the prediction from which a take deviates; None
    for a motion that is no take.
    """

    reduced: ReducedTensor
    parents: tuple[int, ...]
    bones: Bones
    cyclic: bool
    predicted: Variables | None = None

    @cached_property
    def _chains(self) -> dict[int, JointChain]:
        return {}

    def chain(self, joint: int) -> JointChain:
        """Return the chain from the root to a joint, cached."""
        if joint not in self._chains:
            self._chains[joint] = chain_to(joint, self.parents, self.bones, self.reduced)
        return self._chains[joint]

    @property
    def numbers(self) -> int:
        """Number of variables of a motion."""
        r2, r1, _ = self.reduced.core.shape
        return r2 * r1 + CYCLE_VARIABLES * self.cyclic

    def motion(self, numbers: Variables) -> Annotated[Floats, "times freedoms"]:
        """Return the reduced motion (r2, r1) among the variables."""
        r2, r1, _ = self.reduced.core.shape
        return numbers[: r2 * r1].reshape(r2, r1)

    def duration_and_travel(self, numbers: Variables) -> tuple[float, Vector]:
        """Return the logarithm of the duration and the travel (3,); zeros without a cycle."""
        if not self.cyclic:
            return 0.0, np.zeros(3)
        return float(numbers[-CYCLE_VARIABLES]), numbers[-CYCLE_VARIABLES + 1 :]

    def positions(self, numbers: Variables, joint: int, places: Frames) -> RootPath:
        """Return the positions (S, 3), m, of a joint at canonical frames (S,)."""
        moves = self.reduced.moves(self.motion(numbers), places)
        return (
            self.chain(joint)
            .compute_poses(moves, self._travel_so_far(numbers, places))
            .positions[:, -1]
        )

    def evaluate_motions(
        self,
        numbers: Variables,
        motions: ReducedMotions,
        joint: int,
        at: float,
    ) -> Annotated[Floats, "motions 3"]:
        """Return a joint's positions (n, 3), m, at a canonical frame of motions (n, r2 r1).

        All other variables, such as the travel, are those of this motion.
        """
        places = np.full(len(motions), at, np.float64)
        row, gone = self.reduced.row(at), self._travel_so_far(numbers, places)
        moves = row @ motions.reshape(len(motions), len(row), -1)
        moves = self.reduced.with_detail(moves, places)
        return self.chain(joint).compute_poses(moves, gone).positions[:, -1]

    def position_and_gradient(
        self, numbers: Variables, joint: int, at: float
    ) -> tuple[Vector, Annotated[Floats, "3 variables"]]:
        """Return a joint's position (3,), m, at a canonical frame, and gradient (3, numbers)."""
        places = np.array([at], np.float64)
        row, own = self.reduced.row(at), self.chain(joint)
        moves = self.reduced.with_detail(row[None] @ self.motion(numbers), places)
        pose = own.compute_poses(moves, self._travel_so_far(numbers, places))
        by_freedoms, by_turn = own.gradient(pose, 0)
        inner = (row[:, None] * by_freedoms[:, None, :]).reshape(3, -1)
        if self.cyclic:
            share = at / (self.reduced.frames - 1)
            way = np.array([[1.0, 0.0], [0.0, 0.0], [0.0, 1.0]])
            outer = share * np.column_stack([np.zeros(3), way[:, 0], way[:, 1], by_turn])
            inner = np.hstack([inner, outer])
        return pose.positions[0, -1], inner

    def _travel_so_far(self, numbers: Variables, places: Frames) -> RootPath:
        """Return the travel so far (S, 3) at canonical frames (S,)."""
        share = places / (self.reduced.frames - 1)
        return share[:, None] * self.duration_and_travel(numbers)[1]
