"""The smallest correction of a motion that satisfies its constraints.

Gauss-Newton on the whole correction, in the metric of the residuals of captured motions: each step
solves the constraints, linearised at the last iterate, by the least change from the prediction. A
step moves no position by more than STRIDE, and a step that does not reduce the error is halved.
Targets beyond the spread of captured motions, which would take an implausible pose, are approached
up to that spread.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from posefield.common import cancellation
from posefield.common.array_shapes import Gradients, ValueMatrix, Values, Variables
from posefield.common.units import Floats
from posefield.constraints import constraint, reachability
from posefield.constraints.constraint import Constraint, ValuesAndGradients
from posefield.constraints.motion_variables import MotionVariables
from posefield.constraints.pinned_feet import PIN_DEVIATION
from posefield.inference.residual_covariance import ResidualCovariance
from posefield.question.results import ConstraintResult

MAX_STEPS, MAX_HALVINGS = 25, 6
# Convergence, m, m/s or degrees: a hundredth of a millimetre is below the precision of every
# format.
TOLERANCE = 1e-5
# Factor by which a step must reduce the squared error.
SUFFICIENT_DECREASE = 0.98
# Steps that serve the pins alone, and the factor by which each must reduce their squared error.
PIN_STEPS, PIN_DECREASE = 3, 0.9
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

    begun: numbers of the prediction. aims: hard constraints. pins: soft constraints. weights (a,):
    weights of the aims' values in the squared error. pin_variances (k,): variance that each value
    is left, for a sigma of one metre; zero for the aims.
    """

    scene: MotionVariables
    spread: ResidualCovariance
    begun: Variables
    aims: Sequence[Constraint]
    pins: Sequence[Constraint]
    weights: Annotated[Floats, "hard"]
    pin_variances: Values

    @property
    def hard_count(self) -> int:
        """Number of values of hard constraints."""
        return sum(len(aim.target) for aim in self.aims)

    def evaluate(self, numbers: Variables) -> ValuesAndGradients:
        """Return values and gradients of aims and pins."""
        return constraint.evaluate([*self.aims, *self.pins], self.scene, numbers)

    def least_change(self, gradients: Gradients, toward: Values) -> Variables:
        """Return the least change (numbers,) that moves values with these gradients by `toward`."""
        carried = self.spread.apply_shrunk(gradients)
        return carried @ _solve(gradients @ carried + np.diag(self.pin_variances), toward)


def correct(
    scene: MotionVariables,
    spread: ResidualCovariance,
    sigma: float,
    begun: Variables,
    aims: Sequence[Constraint],
    pins: Sequence[Constraint] = (),
) -> Correction:
    """Return the motion nearest to a prediction that satisfies the constraints.

    begun: its numbers. sigma: its standard deviation, m. Constraints beyond the spread of captured
    motions are approached up to it; pins stay near their positions.
    """
    if not aims and not pins:
        return Correction(begun, (), 0, 0.0)
    looked = constraint.evaluate([*aims, *pins], scene, begun)
    near, weights, apart = np.zeros(0), np.zeros(0), 0.0
    if aims:
        found = reachability.assess(scene, spread, sigma, begun, aims, looked)
        near = looked[0][: len(found.differences)] + found.reachable
        weights, apart = found.weights, found.distance
    loose = np.repeat([0.0, (PIN_DEVIATION / sigma) ** 2], [len(near), 3 * len(pins)])
    goal = np.concatenate([near, *(pin.target for pin in pins)])
    task = _Problem(scene, spread, begun, aims, pins, weights, loose)
    numbers, values, steps = _descend(task, looked, goal)
    return Correction(numbers, tuple(_constraint_results(aims, values)), steps, apart)


def _descend(
    task: _Problem, looked: ValuesAndGradients, goal: Values
) -> tuple[Variables, Values, int]:
    """Return the corrected numbers, their values, and the number of steps."""
    numbers, whole = task.begun, True
    for step in range(MAX_STEPS):
        # Pins are worth some steps where the constraints are met already.
        met = _largest_error(task, goal - looked[0]) < TOLERANCE
        if met and (not task.pins or step >= PIN_STEPS):
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

    whole: correct from the prediction anew, pins included. None if no step reduces the error.
    """
    (values, gradients), hard_count = looked, task.hard_count
    left = goal - values
    share = min(1.0, TRUST_RADIUS / max(_largest_distance(task.aims, left), 1e-12))
    base = task.begun if whole else numbers
    if not whole:
        left[hard_count:] = 0.0
    for _ in range(MAX_HALVINGS):
        cancellation.check()
        toward = share * left + gradients @ (numbers - base)
        tried = base + task.least_change(gradients, toward)
        found = task.evaluate(tried)
        if _is_better(task, goal - values, goal - found[0]):
            return tried, found, bool(share < 1.0)
        if _largest_error(task, goal - values) < TOLERANCE:
            return None
        share *= 0.5
    return None


def _is_better(task: _Problem, before: Values, after: Values) -> bool:
    """Return whether a step reduces the error of the constraints, or that of the pins alone.

    before, after: errors of aims and pins. The latter counts while the constraints are met.
    """
    count = task.hard_count
    old, new = (_weighted_error(left[:count], task.weights) for left in (before, after))
    if new < SUFFICIENT_DECREASE * old:
        return True
    slipped, slips = (float(np.sum(np.square(left[count:]))) for left in (before, after))
    return _largest_error(task, after) < MISS_TOLERANCE and slips < PIN_DECREASE * slipped


def _largest_error(task: _Problem, left: Values) -> float:
    return float(np.abs(left[: task.hard_count]).max(initial=0.0))


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


def _weighted_error(left: Annotated[Floats, "hard"], worth: Annotated[Floats, "hard"]) -> float:
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
