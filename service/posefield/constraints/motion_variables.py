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
from posefield.motion.hinges import Hinges
from posefield.motion.quat import CHARTS, RotationChart

HingeAngles = Annotated[Floats, "frames all_hinges 3"]


@dataclass(frozen=True)
class JointChain:
    """Chain of C joints from the root to one joint.

    bones: (C, 3), m. rotations: mean rotation matrices (C, 3, 3). mean (3 + 3 C,), directions (r1,
    3 + 3 C): rows of the reduced tensor for the root's position and the chain's rotations. chart:
    of the numbers of rotations. hinges: of the chain, with their mean rotations (H, 4) and their
    rows among those of the motion.
    """

    bones: Annotated[Floats, "chain 3"]
    rotations: Annotated[Floats, "chain 3 3"]
    mean: Annotated[Floats, "dof"]
    directions: Annotated[Floats, "freedoms dof"]
    chart: RotationChart
    hinges: Hinges
    hinge_means: Annotated[Floats, "hinges 4"]
    hinge_rows: tuple[int, ...]

    def positions(
        self, moves: Annotated[Floats, "frames freedoms"], travel: RootPath, centres: HingeAngles
    ) -> Annotated[Floats, "frames 3"]:
        """Return the last joint's positions (S, 3), m, at coefficients (S, r1) of the first mode.

        travel (S, 3): of the root so far: to the left and ahead, m, and turn, rad. centres: angles
        (S, H, 3) of the motion's hinges in the prediction, rad.
        """
        return self._forward(moves, travel, centres)[2][:, -1]

    def position_and_gradients(
        self,
        moves: Annotated[Floats, "1 freedoms"],
        travel: Annotated[Floats, "1 3"],
        centres: Annotated[Floats, "1 all_hinges 3"],
    ) -> tuple[Vector, Annotated[Floats, "3 freedoms"], Vector]:
        """Return the last joint's position (3,), m, and its gradients.

        The first is by the coefficients of the first mode (3, r1), m; the second by the turn of the
        travel (3,), m per radian.
        """
        vectors, turned, positions, slopes = self._forward(moves, travel, centres)
        vectors, turned, positions = vectors[0], turned[0], positions[0]
        jacobians = self.chart.right_jacobian(vectors)
        if slopes is not None:
            jacobians[list(self.hinges.joints)] = slopes[0] @ jacobians[list(self.hinges.joints)]
        axes = turned @ jacobians
        arms = positions[-1] - positions
        by_axes = quat.cross(np.swapaxes(axes, -1, -2), arms[:, None])
        by_turning = by_axes.reshape(-1, 3).T @ self.directions[:, 3:].T
        return positions[-1], by_turning + self.directions[:, :3].T, quat.cross(UP, arms[0])

    def _forward(
        self, moves: Annotated[Floats, "frames freedoms"], travel: RootPath, centres: HingeAngles
    ) -> tuple[
        Annotated[Floats, "frames chain 3"],
        Annotated[Floats, "frames chain 3 3"],
        Annotated[Floats, "frames chain 3"],
        Annotated[Floats, "frames hinges 3 3"] | None,
    ]:
        """Return numbers of the rotations, orientations and positions, m, of the joints.

        The last are the slopes of the limits of its hinges; None where none is beyond.
        """
        numbers = self.mean + moves @ self.directions
        vectors = numbers[:, 3:].reshape(len(moves), -1, 3)
        turns = self.rotations @ quat.to_matrix(self.chart.quaternions(vectors))
        slopes = None
        if len(self.hinges):
            places = list(self.hinges.joints)
            bent = quat.mul(self.hinge_means, self.chart.quaternions(vectors[:, places]))
            angles = self.hinges.turn_angles(bent)
            limited = self.hinges.limit(angles, centres[:, list(self.hinge_rows)])
            if limited.beyond.any():
                turns[:, places] = quat.to_matrix(self.hinges.limited_turns(bent, limited))
                slopes = self.hinges.slopes(limited)
        if travel[:, 2].any():
            turns[:, 0] = quat.to_matrix(quat.from_axis_angle(UP, travel[:, 2])) @ turns[:, 0]
        turned, positions = turns.copy(), np.empty_like(vectors)
        positions[:, 0] = numbers[:, :3]
        positions[:, 0, [0, 2]] += travel[:, :2]
        for link in range(1, len(self.bones)):
            above = turned[:, link - 1]
            positions[:, link] = positions[:, link - 1] + above @ self.bones[link]
            turned[:, link] = above @ turns[:, link]
        return vectors, turned, positions, slopes


CYCLE_VARIABLES = 4
"""Variables of a cycle in addition to the reduced motion: logarithm of the duration; travel to the
left and ahead, m; change of heading, rad.
"""


@dataclass(frozen=True)
class MotionVariables:
    """Skeleton and model level of a motion.

    reduced: reduced tensor. parents: of the joints. bones: (J, 3), m. cyclic: true for cycles,
    which have a travel. predicted: variables of the prediction from which a take or a correction
    deviates. hinges: limits of joints.
    """

    reduced: ReducedTensor
    parents: tuple[int, ...]
    bones: Bones
    cyclic: bool
    predicted: Variables
    hinges: Hinges

    @cached_property
    def _chains(self) -> dict[int, JointChain]:
        return {}

    @cached_property
    def _canonical_centres(self) -> Annotated[Floats, "frames hinge_angles"]:
        """Angles (T, 3 H) of the hinges in the prediction at the canonical frames."""
        moves = self.reduced.time @ self.motion(self.predicted)
        turns = self.reduced.joint_turns(moves, self.hinges.joints)
        return self.hinges.turn_angles(turns).reshape(len(moves), -1)

    def hinge_centres(self, frames: Frames) -> HingeAngles:
        """Return the predicted angles (S, H, 3) of the hinges at canonical frames (S,), rad."""
        if not len(self.hinges):
            return np.zeros((len(frames), 0, 3))
        centres = quat.interpolate_rows(self._canonical_centres, frames)
        return centres.reshape(len(frames), -1, 3)

    def chain(self, joint: int) -> JointChain:
        """Return the chain from the root to a joint, cached."""
        if joint not in self._chains:
            links = [joint]
            while links[0]:
                links.insert(0, self.parents[links[0]])
            numbers = [0, 1, 2, *(3 + 3 * link + axis for link in links for axis in range(3))]
            self._chains[joint] = JointChain(
                self.bones[links],
                quat.to_matrix(self.reduced.rotations[links]),
                self.reduced.mean[numbers],
                self.reduced.directions[:, numbers],
                CHARTS[self.reduced.chart],
                (among := self.hinges.of_chain(links)),
                self.reduced.rotations[[links[place] for place in among.joints]],
                tuple(self.hinges.joints.index(links[place]) for place in among.joints),
            )
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

    def positions(self, numbers: Variables, joint: int, frames: Frames) -> RootPath:
        """Return the positions (S, 3), m, of a joint at canonical frames (S,)."""
        moves = self.reduced.moves(self.motion(numbers), frames)
        travel = self._travel_so_far(numbers, frames)
        return self.chain(joint).positions(moves, travel, self.hinge_centres(frames))

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
        frames = np.full(len(motions), at, np.float64)
        row, travel = self.reduced.row(at), self._travel_so_far(numbers, frames)
        moves = row @ motions.reshape(len(motions), len(row), -1)
        moves = self.reduced.with_detail(moves, frames)
        return self.chain(joint).positions(moves, travel, self.hinge_centres(frames))

    def position_and_gradient(
        self, numbers: Variables, joint: int, at: float
    ) -> tuple[Vector, Annotated[Floats, "3 variables"]]:
        """Return a joint's position (3,), m, at a canonical frame, and gradient (3, numbers)."""
        frames = np.array([at], np.float64)
        row = self.reduced.row(at)
        moves = self.reduced.with_detail(row[None] @ self.motion(numbers), frames)
        position, by_freedoms, by_turn = self.chain(joint).position_and_gradients(
            moves, self._travel_so_far(numbers, frames), self.hinge_centres(frames)
        )
        inner = (row[:, None] * by_freedoms[:, None, :]).reshape(3, -1)
        if self.cyclic:
            share = at / (self.reduced.frames - 1)
            axes = np.array([[1.0, 0.0], [0.0, 0.0], [0.0, 1.0]])
            outer = share * np.column_stack([np.zeros(3), axes[:, 0], axes[:, 1], by_turn])
            inner = np.hstack([inner, outer])
        return position, inner

    def _travel_so_far(self, numbers: Variables, frames: Frames) -> RootPath:
        """Return the travel so far (S, 3) at canonical frames (S,)."""
        share = frames / (self.reduced.frames - 1)
        return share[:, None] * self.duration_and_travel(numbers)[1]
