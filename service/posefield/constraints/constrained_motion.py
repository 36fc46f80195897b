"""Constrained motions, predicted or corrected: their variables and forward kinematics."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

import numpy as np

from posefield.common import frame_groups
from posefield.common.units import (
    UP,
    Bones,
    Floats,
    Frames,
    ReducedMotions,
    RootPath,
    Rotations,
    Variables,
    Vector,
)
from posefield.inference.reduced_motion import ReducedTensor
from posefield.inference.session import PredictionState
from posefield.locomotion import floor_plane
from posefield.locomotion.stride import Strides
from posefield.motion import quat, skeleton
from posefield.motion.hinges import Hinges
from posefield.motion.quat import CHARTS, RotationChart
from posefield.question.results import ConstraintResult

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
        if self.hinges.joints:
            joints = list(self.hinges.joints)
            bent = quat.mul(self.hinge_means, self.chart.quaternions(vectors[:, joints]))
            angles = self.hinges.turn_angles(bent)
            limited = self.hinges.limit(angles, centres[:, list(self.hinge_rows)])
            if limited.beyond.any():
                turns[:, joints] = quat.to_matrix(self.hinges.limited_turns(bent, limited))
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
        if not self.hinges.joints:
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
                self.reduced.rotations[[links[row] for row in among.joints]],
                tuple(self.hinges.joints.index(links[row]) for row in among.joints),
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


@dataclass(frozen=True)
class ConstrainedMotion:
    """A motion, predicted or corrected.

    numbers: the motion as the variables of the correction. state: the model's prediction.
    results: error of each constraint. steps: of the correction. distance: Mahalanobis distance of
    the constraints from the prediction. is_take: whether it deviates from the prediction at random.
    duration_factor: duration over the predicted one, of a take of a motion without cycle.
    """

    scene: MotionVariables
    numbers: Variables
    state: PredictionState
    results: tuple[ConstraintResult, ...]
    steps: int = 0
    distance: float = 0.0
    is_take: bool = False
    duration_factor: float = 1.0

    @property
    def duration(self) -> float:
        """Duration of the clip, s."""
        # The duration of motions without cycles is no variable of the correction.
        fixed = 1.0 if self.scene.cyclic else self.state.duration * self.duration_factor
        return float(np.exp(self.scene.duration_and_travel(self.numbers)[0])) * fixed

    @property
    def travel(self) -> Vector:
        """Travel of a whole cycle (3,): to the left and ahead, m, and change of heading, rad."""
        return self.scene.duration_and_travel(self.numbers)[1]

    def poses(self, frames: Frames) -> tuple[Rotations, RootPath]:
        """Return rotations (S, J, 4) and root positions (S, 3), m, at canonical frames (S,)."""
        return evaluate_poses([self], [frames])[0]

    def roots(self, frames: Frames) -> RootPath:
        """Return root positions (S, 3), m, at canonical frames (S,)."""
        scene = self.scene
        roots = scene.reduced.roots(scene.motion(self.numbers), frames)
        if not scene.cyclic:
            return roots
        share = frames / (scene.reduced.frames - 1)
        return skeleton.moved_roots(roots, share[:, None] * self.travel)

    def curve_values(self, frames: Frames) -> Annotated[Floats, "frames curves"]:
        """Return the values (S, C) of the curves at canonical frames (S,)."""
        return self.scene.reduced.curve_values(self.scene.motion(self.numbers), frames)


def evaluate_poses(
    motions: Sequence[ConstrainedMotion], frames: Sequence[Frames]
) -> list[tuple[Rotations, RootPath]]:
    """Return rotations (S, J, 4) and root positions (S, 3), m, at canonical frames (S,) of each.

    All are motions of one model, whose levels share the mean rotations. Each has the bytes that it
    has alone.
    """
    if not motions:
        return []
    groups, first = frame_groups.of_lengths(frames), motions[0].scene
    pairs = [
        motion.scene.reduced.turn_products(motion.scene.motion(motion.numbers), at)
        for motion, at in zip(motions, frames, strict=True)
    ]
    products, roots = (np.concatenate(arrays) for arrays in zip(*pairs, strict=True))
    rotations = first.reduced.rotations_of(products)
    if first.hinges.joints:
        pairs_of_centres = zip(motions, frames, strict=True)
        centres = [motion.scene.hinge_centres(at) for motion, at in pairs_of_centres]
        rotations = first.hinges.within(rotations, np.concatenate(centres))
    if first.cyclic:
        travel = np.array([motion.travel for motion in motions])[groups.group]
        share = np.concatenate(frames) / (first.reduced.frames - 1)
        rotations, roots = skeleton.add_travel(rotations, roots, share[:, None] * travel)
    return list(zip(groups.split(rotations), groups.split(roots), strict=True))


def to_strides(motion: ConstrainedMotion) -> Strides:
    """Return the cycle of a motion, or its straight line from first to last pose."""
    last = motion.scene.reduced.frames - 1.0
    roots = floor_plane.project(motion.roots(np.array([0.0, last])))
    durations, turns = np.array([motion.duration]), motion.travel[2:]
    if not motion.scene.cyclic:
        return Strides(durations, roots[1:] - roots[:1], np.zeros(1), roots[:1])
    gap = np.array([motion.travel[1] + 1j * motion.travel[0]])
    # A cycle without its travel ends at its start.
    return Strides(durations, floor_plane.inverse_arc(gap, turns), turns, roots[1:] - gap)
