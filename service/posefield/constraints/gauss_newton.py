"""The smallest correction of a motion that satisfies its constraints.

Gauss-Newton on the whole correction, in the metric of the residuals of captured motions: each step
solves the constraints, linearised at the last iterate, by the least change from the prediction. A
step moves no position by more than STRIDE, and a step that does not reduce the error is halved.
Targets beyond the spread of captured motions, which would take an implausible pose, are approached
up to that spread.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from posefield.common import cancellation
from posefield.common.array_shapes import Gradients, ValueMatrix, Values, Variables
from posefield.constraints import constraint, reachability
from posefield.constraints.constraint import Constraint, ValuesAndGradients
from posefield.constraints.motion_variables import MotionVariables
from posefield.inference.residual_covariance import ResidualCovariance
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
class _Problem:
    """Constraints and metric of one correction.

    begun: numbers of the prediction. aims: constraints. weights (k,): of their values in the
    squared error.
    """

    scene: MotionVariables
    spread: ResidualCovariance
    begun: Variables
    aims: Sequence[Constraint]
    weights: Values

    def evaluate(self, numbers: Variables) -> ValuesAndGradients:
        """Return values and gradients of the aims."""
        return constraint.evaluate(self.aims, self.scene, numbers)

    def least_change(self, gradients: Gradients, toward: Values) -> Variables:
        """Return the least change (numbers,) that moves values with these gradients by `toward`."""
        carried = self.spread.apply_shrunk(gradients)
        return carried @ _solve(gradients @ carried, toward)


def correct(
    scene: MotionVariables,
    spread: ResidualCovariance,
    sigma: float,
    begun: Variables,
    aims: Sequence[Constraint],
) -> Correction:
    """Return the motion nearest to a prediction that satisfies the constraints.

    begun: its numbers. sigma: its standard deviation, m. Constraints beyond the spread of captured
    motions are approached up to it.
    """
    if not aims:
        return Correction(begun, (), 0, 0.0)
    looked = constraint.evaluate(aims, scene, begun)
    judged, seen = begun, looked
    if scene.predicted is not None:
        # A take deviates from the prediction already; the spread is that about the prediction.
        judged, seen = scene.predicted, constraint.evaluate(aims, scene, scene.predicted)
    found = reachability.assess(scene, spread, sigma, judged, aims, seen)
    task = _Problem(scene, spread, begun, aims, found.weights)
    numbers, values, steps = _descend(task, looked, seen[0] + found.reachable)
    return Correction(numbers, tuple(_constraint_results(aims, values)), steps, found.distance)


def _descend(
    task: _Problem, looked: ValuesAndGradients, goal: Values
) -> tuple[Variables, Values, int]:
    """Return the corrected numbers, their values, and the number of steps."""
    numbers, whole = task.begun, True
    for step in range(MAX_STEPS):
        if _largest_error(goal - looked[0]) < TOLERANCE:
            return numbers, looked[0], step
        moved = _next_iterate(task, numbers, looked, goal, whole)
        if moved is None:
            return numbers, looked[0], step
        numbers, looked, whole = moved
    return numbers, looked[0], MAX_STEPS


def _next_iterate(
    task: _Problem,
    numbers: Variables,
    looked: ValuesAndGradients,
    goal: Values,
    whole: bool,
) -> tuple[Variables, ValuesAndGradients, bool] | None:
    """Return the next numbers, their values and gradients, and whether the step was shortened.

    whole: correct from the prediction anew. None if no step reduces the error.
    """
    values, gradients = looked
    left = goal - values
    share = min(1.0, TRUST_RADIUS / max(_largest_distance(task.aims, left), 1e-12))
    base = task.begun if whole else numbers
    for _ in range(MAX_HALVINGS):
        cancellation.check()
        toward = share * left + gradients @ (numbers - base)
        tried = base + task.least_change(gradients, toward)
        found = task.evaluate(tried)
        if _is_better(task, goal - values, goal - found[0]):
            return tried, found, bool(share < 1.0)
        share *= 0.5
    return None


def _is_better(task: _Problem, before: Values, after: Values) -> bool:
    """Return whether a step reduces the error of the constraints."""
    old, new = (_weighted_error(left, task.weights) for left in (before, after))
    return new < SUFFICIENT_DECREASE * old


def _largest_error(left: Values) -> float:
    return float(np.abs(left).max(initial=0.0))


def _solve(matrix: ValueMatrix, right: Values) -> Values:
    """Return the solution of a covariance's system.

    A ridge distributes the error between contradicting constraints.
    """
    ridge = 1e-9 * np.diag(np.diagonal(matrix)) + 1e-300 * np.eye(len(matrix))
    return np.asarray(np.linalg.solve(matrix + ridge, right), np.float64)


def _largest_distance(aims: Sequence[Constraint], left: Values) -> float:
    """Return the largest distance, m, among the values (k,) in metres."""
    units = [aim.unit for aim in aims for _ in aim.target]
    places = zip(left[: len(units)], units, strict=True)
    return max((abs(value) for value, unit in places if unit == "m"), default=0.0)


def _weighted_error(left: Values, worth: Values) -> float:
    return float(np.sum(worth * np.square(left)))


def distance(
    scene: MotionVariables,
    spread: ResidualCovariance,
    sigma: float,
    numbers: Variables,
    aims: Sequence[Constraint],
) -> float:
    """Return the Mahalanobis distance of the constraints from a motion (numbers,)."""
    looked = constraint.evaluate(aims, scene, numbers)
    return reachability.assess(scene, spread, sigma, numbers, aims, looked).distance


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
