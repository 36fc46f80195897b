"""The smallest correction of a motion that satisfies its constraints.

Gauss-Newton on the whole correction, in the metric of the residuals of captured motions: each step
solves the constraints, linearised at the last iterate, by the least change from the prediction. A
step moves no position by more than STRIDE, and a step that does not reduce the error is halved.
Targets beyond the spread of captured motions, which would take an implausible pose, are approached
up to that spread.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Annotated

import numpy as np

from posefield.common.units import Booleans, Floats, Indices, Values
from posefield.constraints import constraint, reachability
from posefield.constraints.constrained_motion import ConstrainedMotion, MotionVariables
from posefield.constraints.constraint import (
    Constraint,
    StackedGradients,
    StackedValues,
    StackedVariables,
)
from posefield.constraints.reachability import CorrectionTask, stacked_dot, stacked_solve
from posefield.inference import reduced_motion
from posefield.inference.reduced_motion import ReducedTensor, ResidualCovariance
from posefield.inference.session import PredictionState, Session
from posefield.model_file import onnx_file
from posefield.model_file.model_card import ModelCard
from posefield.motion import hinges
from posefield.question.results import ConstraintResult

MAX_STEPS, MAX_HALVINGS = 25, 6
# Convergence, m, m/s or degrees: a hundredth of a millimetre is below the precision of every
# format.
TOLERANCE = 1e-5
# Factor by which a step must reduce the squared error.
SUFFICIENT_DECREASE = 0.98
# Largest move of a position in one step, m, for which the linearisation is trusted.
TRUST_RADIUS = 0.15
# Above this error, in its unit, a target counts as missed.
MISS_TOLERANCE = 1e-3


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
        inner = self.reduced.motion(state.coefficients).ravel()
        outer = [np.log(state.duration), *state.travel] if self.card.cyclic else []
        numbers, limits = np.concatenate([inner, outer]), hinges.from_card(self.card.hinges)
        parents, cyclic = self.card.skeleton.parents, self.card.cyclic
        scene = MotionVariables(self.reduced, parents, state.bones, cyclic, numbers, limits)
        return ConstrainedMotion(scene, numbers, state, ())

    def solve_all(self, tasks: Sequence[CorrectionTask]) -> list[ConstrainedMotion]:
        """Return the motions nearest to others that satisfy constraints.

        Constraints beyond the spread of captured motions are approached up to it. Each motion has
        the bytes that it has alone: products are those of one motion, stacked.
        """
        corrected = {
            index: replace(motion, results=(), steps=0, distance=0.0)
            for index, (motion, aims) in enumerate(tasks)
            if not aims
        }
        kinds = [_kind(*task) for task in tasks]
        for kind in dict.fromkeys(kinds):
            rows = [row for row, other in enumerate(kinds) if other == kind and tasks[row][1]]
            if rows:
                alike = _correct_alike(self.spread, [tasks[row] for row in rows])
                corrected |= zip(rows, alike, strict=True)
        return [corrected[row] for row in range(len(tasks))]

    def distance(self, motion: ConstrainedMotion, aims: Sequence[Constraint]) -> float:
        """Return the Mahalanobis distance of the constraints from a predicted motion."""
        numbers = motion.numbers[None]
        looked = constraint.evaluate_many(aims, [motion.scene], numbers)
        return float(
            reachability.assess(self.spread, [(motion, aims)], numbers, *looked).distance[0]
        )


def build_corrector(session: Session, level: int) -> LevelCorrector:
    """Return the data for corrections at a level."""
    weights = onnx_file.initializers(session.content)
    card, samples = session.card, session.kriging_weights.samples
    reduced = reduced_motion.read(weights, card.levels[level], card)
    spread = reduced_motion.estimate(card, weights, samples, reduced)
    return LevelCorrector(card, reduced, spread)


def _kind(motion: ConstrainedMotion, aims: Sequence[Constraint]) -> tuple[object, ...]:
    """Return what tasks have in common that are solved at once."""
    kinds = tuple((aim.kind, len(aim.target)) for aim in aims)
    return kinds, len(motion.numbers), motion.is_take


@dataclass(frozen=True)
class _Problems:
    """Constraints and metric of M corrections of one kind.

    aims: of one of them, whose targets are not used. first: (M, numbers), before the correction.
    goals: values (M, k) to reach. weights (M, k): of the values in the squared errors.
    """

    scenes: Sequence[MotionVariables]
    spread: ResidualCovariance
    aims: Sequence[Constraint]
    first: StackedVariables
    goals: StackedValues
    weights: StackedValues

    def select(self, chosen: Annotated[Indices, "chosen"]) -> "_Problems":
        """Return some of the problems."""
        return replace(
            self,
            scenes=[self.scenes[row] for row in chosen.tolist()],
            first=self.first[chosen],
            goals=self.goals[chosen],
            weights=self.weights[chosen],
        )

    def evaluate(self, numbers: StackedVariables) -> tuple[StackedValues, StackedGradients]:
        """Return values and gradients of the aims."""
        return constraint.evaluate_many(self.aims, self.scenes, numbers)

    def least_changes(self, gradients: StackedGradients, toward: StackedValues) -> StackedVariables:
        """Return the least changes (M, numbers) that move values with gradients by `toward`."""
        carried = self.spread.apply_shrunk(gradients)
        share = _solve(gradients @ carried, toward)
        return np.asarray((carried @ share[..., None])[..., 0])

    def errors(self, values: StackedValues) -> Annotated[Floats, "motions"]:
        """Return the squared errors (M,) of values (M, k)."""
        return stacked_dot(self.weights, np.square(self.goals - values))


@dataclass(frozen=True)
class _Iterates:
    """Motions of M corrections. anew: whether to correct from the predictions anew (M,)."""

    numbers: StackedVariables
    values: StackedValues
    gradients: StackedGradients
    anew: Annotated[Booleans, "motions"]

    def select(self, chosen: Annotated[Indices, "chosen"]) -> "_Iterates":
        """Return some of the iterates."""
        return _Iterates(*(getattr(self, column.name)[chosen] for column in fields(self)))

    def write(self, rows: Annotated[Indices, "chosen"], iterates: "_Iterates") -> None:
        """Replace some of the iterates by others."""
        for column in fields(self):
            getattr(self, column.name)[rows] = getattr(iterates, column.name)


def _correct_alike(
    spread: ResidualCovariance, tasks: Sequence[CorrectionTask]
) -> list[ConstrainedMotion]:
    scenes, aims = [motion.scene for motion, _ in tasks], tasks[0][1]
    first = np.stack([motion.numbers for motion, _ in tasks])
    looked = constraint.evaluate_many(aims, scenes, first)
    predicted, looked_at_predicted = first, looked
    if tasks[0][0].is_take:
        # A take deviates from the prediction already; the spread is that about the prediction.
        predicted = np.stack([scene.predicted for scene in scenes])
        looked_at_predicted = constraint.evaluate_many(aims, scenes, predicted)
    reach = reachability.assess(spread, tasks, predicted, *looked_at_predicted)
    goals = looked_at_predicted[0] + reach.reachable
    last, steps = _descend(_Problems(scenes, spread, aims, first, goals, reach.weights), looked)
    return [
        replace(
            motion,
            numbers=numbers,
            results=tuple(_constraint_results(aims, values)),
            steps=count,
            distance=float(distance),
        )
        for (motion, aims), numbers, values, count, distance in zip(
            tasks, last.numbers, last.values, steps, reach.distance, strict=True
        )
    ]


def _descend(
    problems: _Problems, looked: tuple[StackedValues, StackedGradients]
) -> tuple[_Iterates, list[int]]:
    """Return the corrected motions, and the number of steps of each."""
    count = len(problems.first)
    last = _Iterates(problems.first.copy(), *looked, np.ones(count, bool))
    steps, active = np.zeros(count, np.int64), np.arange(count)
    for _ in range(MAX_STEPS):
        left = np.abs(problems.goals[active] - last.values[active]).max(axis=1)
        active = active[left >= TOLERANCE]
        if not len(active):
            break
        nearer, iterates = _next_iterates(problems.select(active), last.select(active))
        active = active[nearer]
        last.write(active, iterates)
        steps[active] += 1
    return last, steps.tolist()


def _next_iterates(
    problems: _Problems, now: _Iterates
) -> tuple[Annotated[Booleans, "motions"], _Iterates]:
    """Return which motions a step brings nearer, and their next iterates.

    The others have no step that reduces the error.
    """
    left = problems.goals - now.values
    metres = np.array([aim.unit == "m" for aim in problems.aims for _ in aim.target])
    far = np.maximum(np.abs(left[:, metres]).max(axis=1, initial=0.0), 1e-12)
    share = np.minimum(1.0, TRUST_RADIUS / far)
    base = np.where(now.anew[:, None], problems.first, now.numbers)
    along = (now.gradients @ (now.numbers - base)[..., None])[..., 0]
    before = problems.errors(now.values)
    iterates = now.select(np.arange(len(left)))
    pending = np.arange(len(left))
    for _ in range(MAX_HALVINGS):
        open_problems = problems.select(pending)
        toward = share[pending, None] * left[pending] + along[pending]
        tried = base[pending] + open_problems.least_changes(now.gradients[pending], toward)
        values, gradients = open_problems.evaluate(tried)
        better = open_problems.errors(values) < SUFFICIENT_DECREASE * before[pending]
        done = pending[better]
        shortened = share[done] < 1.0
        iterates.write(done, _Iterates(tried[better], values[better], gradients[better], shortened))
        pending = pending[~better]
        if not len(pending):
            break
        share[pending] *= 0.5
    nearer = np.ones(len(left), bool)
    nearer[pending] = False
    return nearer, iterates.select(np.flatnonzero(nearer))


def _solve(
    matrices: Annotated[Floats, "motions values values"], right: StackedValues
) -> StackedValues:
    """Return the solutions (M, k) of covariances' systems.

    A ridge distributes the error between contradicting constraints.
    """
    eye = np.eye(matrices.shape[-1])
    return stacked_solve(matrices + 1e-9 * matrices * eye + 1e-300 * eye, right)


def _constraint_results(aims: Sequence[Constraint], values: Values) -> list[ConstraintResult]:
    results, start = [], 0
    for aim in aims:
        left = aim.target - values[start : start + len(aim.target)]
        start += len(aim.target)
        misses = np.abs(left) if len(aim.names) > 1 else [np.linalg.norm(left)]
        results += [
            ConstraintResult(name, float(miss), aim.unit, bool(miss <= MISS_TOLERANCE))
            for name, miss in zip(aim.names, misses, strict=True)
        ]
    return results
