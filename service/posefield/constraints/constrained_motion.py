"""Constrained motions: predictions and their nearest motions that satisfy constraints."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from posefield.common import frame_groups
from posefield.common.units import Floats, Frames, RootPath, Rotations, Variables, Vector
from posefield.constraints import constraint, gauss_newton
from posefield.constraints.constraint import Constraint, CorrectionTask
from posefield.constraints.motion_variables import MotionVariables
from posefield.inference import reduced_motion
from posefield.inference.reduced_motion import ReducedTensor, ResidualCovariance
from posefield.inference.session import PredictionState, Session
from posefield.locomotion import floor_plane
from posefield.locomotion.stride import Strides
from posefield.model_file import onnx_file
from posefield.model_file.model_card import ModelCard
from posefield.motion import measures, skeleton
from posefield.motion.measures import MeasuredMotion
from posefield.question.results import ConstraintResult


@dataclass(frozen=True)
class ConstrainedMotion:
    """A motion, predicted or corrected.

    numbers: the motion as the variables of the correction. state: the model's prediction.
    results: error of each constraint. steps: of the correction. distance: Mahalanobis distance of
    the constraints from the prediction.
    """

    scene: MotionVariables
    numbers: Variables
    state: PredictionState
    results: tuple[ConstraintResult, ...]
    steps: int = 0
    distance: float = 0.0

    @property
    def duration(self) -> float:
        """Duration of the clip, s."""
        # Motions without cycles keep the predicted duration.
        fixed = 1.0 if self.scene.cyclic else self.state.duration
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
    parts = [
        own.scene.reduced.turn_products(own.scene.motion(own.numbers), at)
        for own, at in zip(motions, frames, strict=True)
    ]
    products, roots = (np.concatenate(own) for own in zip(*parts, strict=True))
    rotations = first.reduced.rotations_of(products)
    if first.cyclic:
        travel = np.array([own.travel for own in motions])[groups.group]
        share = np.concatenate(frames) / (first.reduced.frames - 1)
        rotations, roots = skeleton.add_travel(rotations, roots, share[:, None] * travel)
    return list(zip(groups.split(rotations), groups.split(roots), strict=True))


@dataclass(frozen=True)
class LevelCorrector:
    """Data for corrections at one level of a model, computed once.

    reduced: reduced tensor. spread: covariance of the residuals of captured motions.
    """

    card: ModelCard
    reduced: ReducedTensor
    spread: ResidualCovariance

    def predict(self, state: PredictionState) -> ConstrainedMotion:
        """Return the predicted motion, without constraints."""
        scene = MotionVariables(
            self.reduced, self.card.skeleton.parents, state.bones, self.card.cyclic
        )
        inner = self.reduced.motion(state.coefficients).ravel()
        beside = [np.log(state.duration), *state.travel] if self.card.cyclic else []
        return ConstrainedMotion(scene, np.concatenate([inner, beside]), state, ())

    def solve_all(
        self, every: Sequence[tuple[ConstrainedMotion, Sequence[Constraint]]]
    ) -> list[ConstrainedMotion]:
        """Return the nearest motions that satisfy constraints, from motions with these."""
        found = gauss_newton.correct(self.spread, [_task(*own) for own in every])
        return [
            ConstrainedMotion(
                begun.scene, own.numbers, begun.state, own.results, own.steps, own.distance
            )
            for (begun, _), own in zip(every, found, strict=True)
        ]

    def distance(self, begun: ConstrainedMotion, aims: Sequence[Constraint]) -> float:
        """Return the Mahalanobis distance of the constraints from a predicted motion."""
        return gauss_newton.distance(self.spread, _task(begun, aims))

    def measured(self, held: ConstrainedMotion) -> dict[str, float]:
        """Return the values of the card's measured controls on a motion."""
        asked = [(c.name, c.measure, 0.0) for c in self.card.controls if c.measure]
        moving = [(name, own, goal) for name, own, goal in asked if not own.is_body_measure]
        found = dict[str, float]()
        for aim in constraint.from_controls(moving, self.reduced.frames):
            values, _ = aim.evaluate(held.scene, held.numbers)
            found |= dict(zip(aim.names, map(float, values), strict=True))
        still = np.zeros((1, len(held.scene.parents), 3))
        seen = MeasuredMotion(still, 0.0, np.zeros(3), held.scene.parents, held.scene.bones)
        found |= {
            name: measures.evaluate(own, seen) for name, own, _ in asked if own.is_body_measure
        }
        return {
            control.name: found[control.name]
            for control in self.card.controls
            if control.name in found
        }


def _task(begun: ConstrainedMotion, aims: Sequence[Constraint]) -> CorrectionTask:
    return CorrectionTask(begun.scene, begun.state.sigma, begun.numbers, aims)


def build_corrector(session: Session, level: int) -> LevelCorrector:
    """Return the data for corrections at a level."""
    weights = onnx_file.initializers(session.content)
    own = reduced_motion.read(weights, session.card.levels[level], session.card)
    return LevelCorrector(
        session.card,
        own,
        reduced_motion.estimate(session.card, weights, session.kriging_weights.samples, own),
    )


def to_strides(held: ConstrainedMotion) -> Strides:
    """Return the cycle of a motion, or its straight line from first to last pose."""
    last = held.scene.reduced.frames - 1.0
    roots = floor_plane.project(held.roots(np.array([0.0, last])))
    durations, turns = np.array([held.duration]), held.travel[2:]
    if not held.scene.cyclic:
        return Strides(durations, roots[1:] - roots[:1], np.zeros(1), roots[:1])
    gap = np.array([held.travel[1] + 1j * held.travel[0]])
    # A cycle without its travel ends at its start.
    return Strides(durations, floor_plane.inverse_arc(gap, turns), turns, roots[1:] - gap)
