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

from posefield.common.units import Booleans, Floats, Indices, Values, Variables
from posefield.constraints import constraint, reachability
from posefield.constraints.constraint import (
    Constraint,
    CorrectionTask,
    StackedGradients,
    StackedValues,
    StackedVariables,
)
from posefield.constraints.motion_variables import MotionVariables
from posefield.constraints.reachability import stacked_dot, stacked_solve
from posefield.inference.reduced_motion import ResidualCovariance
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
class Correction:
    """Result of a correction.

    numbers: of the corrected motion. results: error of each constraint. steps: number of
    iterations. distance: Mahalanobis distance of the constraints from the prediction.
    """

    numbers: Variables
    results: tuple[ConstraintResult, ...]
    steps: int
    distance: float


@dataclass(frozen=True)
class _Problems:
    """Constraints and metric of M corrections of one kind.

    aims: of one of them, whose targets are not used. begun: (M, numbers). goals: values (M, k) to
    reach. weights (M, k): of the values in the squared errors.
    """

    scenes: Sequence[MotionVariables]
    spread: ResidualCovariance
    aims: Sequence[Constraint]
    begun: StackedVariables
    goals: StackedValues
    weights: StackedValues

    def select(self, chosen: Annotated[Indices, "chosen"]) -> "_Problems":
        """Return some of the problems."""
        return replace(
            self,
            scenes=[self.scenes[place] for place in chosen.tolist()],
            begun=self.begun[chosen],
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
    """Motions of M corrections. whole: whether to correct from the predictions anew (M,)."""

    numbers: StackedVariables
    values: StackedValues
    gradients: StackedGradients
    whole: Annotated[Booleans, "motions"]

    def select(self, chosen: Annotated[Indices, "chosen"]) -> "_Iterates":
        """Return some of the iterates."""
        return _Iterates(*(getattr(self, own.name)[chosen] for own in fields(self)))

    def write(self, places: Annotated[Indices, "chosen"], found: "_Iterates") -> None:
        """Replace some of the iterates by others."""
        for own in fields(self):
            getattr(self, own.name)[places] = getattr(found, own.name)


def correct(spread: ResidualCovariance, tasks: Sequence[CorrectionTask]) -> list[Correction]:
    """Return the motions nearest to predictions that satisfy the constraints.

    Constraints beyond the spread of captured motions are approached up to it. Each motion has the
    bytes that it has alone: products are those of one motion, stacked.
    """
    found: dict[int, Correction] = {
        place: Correction(own.begun, (), 0, 0.0) for place, own in enumerate(tasks) if not own.aims
    }
    kinds = [own.kind for own in tasks]
    for kind in dict.fromkeys(kinds):
        places = [at for at, own in enumerate(kinds) if own == kind and tasks[at].aims]
        if places:
            made = _correct_alike(spread, [tasks[place] for place in places])
            found |= zip(places, made, strict=True)
    return [found[place] for place in range(len(tasks))]


def _correct_alike(spread: ResidualCovariance, tasks: Sequence[CorrectionTask]) -> list[Correction]:
    scenes, aims = [own.scene for own in tasks], tasks[0].aims
    begun = np.stack([own.begun for own in tasks])
    looked = constraint.evaluate_many(aims, scenes, begun)
    judged, seen = begun, looked
    if scenes[0].predicted is not None:
        # A take deviates from the prediction already; the spread is that about the prediction.
        judged = np.stack([own.scene.predicted for own in tasks if own.scene.predicted is not None])
        seen = constraint.evaluate_many(aims, scenes, judged)
    found = reachability.assess(spread, tasks, judged, seen)
    problems = _Problems(scenes, spread, aims, begun, seen[0] + found.reachable, found.weights)
    last, steps = _descend(problems, looked)
    return [
        Correction(numbers, tuple(_constraint_results(own.aims, values)), count, float(distance))
        for own, numbers, values, count, distance in zip(
            tasks, last.numbers, last.values, steps, found.distance, strict=True
        )
    ]


def _descend(
    problems: _Problems, looked: tuple[StackedValues, StackedGradients]
) -> tuple[_Iterates, list[int]]:
    """Return the corrected motions, and the number of steps of each."""
    count = len(problems.begun)
    now = _Iterates(problems.begun.copy(), *looked, np.ones(count, bool))
    steps, active = np.zeros(count, np.int64), np.arange(count)
    for _ in range(MAX_STEPS):
        left = np.abs(problems.goals[active] - now.values[active]).max(axis=1)
        active = active[left >= TOLERANCE]
        if not len(active):
            break
        moved, found = _next_iterates(problems.select(active), now.select(active))
        active = active[moved]
        now.write(active, found)
        steps[active] += 1
    return now, steps.tolist()


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
    base = np.where(now.whole[:, None], problems.begun, now.numbers)
    along = (now.gradients @ (now.numbers - base)[..., None])[..., 0]
    before = problems.errors(now.values)
    found = now.select(np.arange(len(left)))
    pending = np.arange(len(left))
    for _ in range(MAX_HALVINGS):
        own = problems.select(pending)
        toward = share[pending, None] * left[pending] + along[pending]
        tried = base[pending] + own.least_changes(now.gradients[pending], toward)
        values, gradients = own.evaluate(tried)
        better = own.errors(values) < SUFFICIENT_DECREASE * before[pending]
        done = pending[better]
        shortened = share[done] < 1.0
        found.write(done, _Iterates(tried[better], values[better], gradients[better], shortened))
        pending = pending[~better]
        if not len(pending):
            break
        share[pending] *= 0.5
    moved = np.ones(len(left), bool)
    moved[pending] = False
    return moved, found.select(np.flatnonzero(moved))


def _solve(
    matrices: Annotated[Floats, "motions values values"], right: StackedValues
) -> StackedValues:
    """Return the solutions (M, k) of covariances' systems.

    A ridge distributes the error between contradicting constraints.
    """
    eye = np.eye(matrices.shape[-1])
    return stacked_solve(matrices + 1e-9 * matrices * eye + 1e-300 * eye, right)


def distance(spread: ResidualCovariance, task: CorrectionTask) -> float:
    """Return the Mahalanobis distance of the constraints from a motion."""
    numbers = task.begun[None]
    looked = constraint.evaluate_many(task.aims, [task.scene], numbers)
    return float(reachability.assess(spread, [task], numbers, looked).distance[0])


def _constraint_results(aims: Sequence[Constraint], found: Values) -> list[ConstraintResult]:
    said, start = [], 0
    for aim in aims:
        left = aim.target - found[start : start + len(aim.target)]
        start += len(aim.target)
        parts = np.abs(left) if len(aim.names) > 1 else [np.linalg.norm(left)]
        said += [
            ConstraintResult(name, float(miss), aim.unit, bool(miss <= MISS_TOLERANCE))
            for name, miss in zip(aim.names, parts, strict=True)
        ]
    return said
