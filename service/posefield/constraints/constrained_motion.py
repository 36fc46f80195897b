"""Constrained motions: predictions and their nearest motions that satisfy constraints."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from posefield.common import frame_groups
from posefield.common.units import Floats, Frames, RootPath, Rotations, Variables, Vector
from posefield.constraints.motion_variables import MotionVariables
from posefield.inference.session import PredictionState
from posefield.locomotion import floor_plane
from posefield.locomotion.stride import Strides
from posefield.motion import skeleton
from posefield.question.results import ConstraintResult


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
    if len(first.hinges):
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
