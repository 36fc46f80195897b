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
from posefield.common.units import Floats
from posefield.constraints import constraint as looking
from posefield.constraints import reachability
from posefield.constraints.constraint import Aim, Looked
from posefield.constraints.motion_variables import Scene
from posefield.constraints.pinned_feet import LOOSE
from posefield.inference.residual_covariance import Spread
from posefield.question.results import Met

STEPS, HALVINGS = 25, 6
# Convergence, m, m/s or degrees: a hundredth of a millimetre is below the precision of every
# format.
CLOSE = 1e-5
# Factor by which a step must reduce the squared error.
ENOUGH = 0.98
# Largest move of a position in one step, m, for which the linearisation is trusted.
STRIDE = 0.15
# Above this error, in its unit, a target counts as missed.
MISSED = 1e-3


@dataclass(frozen=True)
class Corrected:
    """Result of a correction.

    numbers: of the corrected motion. met: error of each constraint. steps: number of iterations.
    distance: Mahalanobis distance of the constraints from the prediction.
    """

    numbers: Floats
    met: tuple[Met, ...]
    steps: int
    distance: float


@dataclass(frozen=True)
class _Task:
    """Constraints and metric of one correction.

    begun: numbers of the prediction. aims: hard constraints. pins: soft constraints. worth (a,):
    weights of the aims' values in the squared error. loose (k,): variance that each value is left,
    for a sigma of one metre; zero for the aims.
    """

    scene: Scene
    spread: Spread
    begun: Floats
    aims: Sequence[Aim]
    pins: Sequence[Aim]
    worth: Floats
    loose: Floats

    @property
    def firm(self) -> int:
        """Number of values of hard constraints."""
        return sum(len(aim.goal) for aim in self.aims)

    def look(self, numbers: Floats) -> Looked:
        """Return values and gradients of aims and pins."""
        return looking.look([*self.aims, *self.pins], self.scene, numbers)

    def least(self, gradients: Floats, toward: Floats) -> Floats:
        """Return the least change (numbers,) that moves values with these gradients by `toward`."""
        carried = self.spread.shrunk(gradients)
        return carried @ _solve(gradients @ carried + np.diag(self.loose), toward)


def meet(
    scene: Scene,
    spread: Spread,
    sigma: float,
    begun: Floats,
    aims: Sequence[Aim],
    pins: Sequence[Aim] = (),
) -> Corrected:
    """Return the motion nearest to a prediction that satisfies the constraints.

    begun: its numbers. sigma: its standard deviation, m. Constraints beyond the spread of captured
    motions are approached up to it; pins stay near their positions.
    """
    looked = looking.look([*aims, *pins], scene, begun)
    found = reachability.of(scene, spread, sigma, begun, aims, looked)
    loose = np.repeat([0.0, (LOOSE / sigma) ** 2], [len(found.left), 3 * len(pins)])
    near = looked[0][: len(found.left)] + found.way
    goal = np.concatenate([near, *(pin.goal for pin in pins)])
    task = _Task(scene, spread, begun, aims, pins, found.worth, loose)
    numbers, values, steps = _descend(task, looked, goal)
    return Corrected(numbers, tuple(_met(aims, values)), steps, found.distance)


def _descend(task: _Task, looked: Looked, goal: Floats) -> tuple[Floats, Floats, int]:
    """Return the corrected numbers, their values, and the number of steps."""
    numbers, whole = task.begun, True
    for step in range(STEPS):
        if np.abs((goal - looked[0])[: task.firm]).max() < CLOSE:
            return numbers, looked[0], step
        moved = _nearer(task, numbers, looked, goal, whole)
        if moved is None:
            return numbers, looked[0], step
        numbers, looked, whole = moved
    return numbers, looked[0], STEPS


def _nearer(
    task: _Task, numbers: Floats, looked: Looked, goal: Floats, whole: bool
) -> tuple[Floats, Looked, bool] | None:
    """Return the next numbers, their values and gradients, and whether the step was shortened.

    whole: correct from the prediction anew, pins included. None if no step reduces the error.
    """
    (values, gradients), firm = looked, task.firm
    left = goal - values
    share = min(1.0, STRIDE / max(_apart(task.aims, left), 1e-12))
    base = task.begun if whole else numbers
    if not whole:
        left[firm:] = 0.0
    for _ in range(HALVINGS):
        cancellation.check()
        toward = share * left + gradients @ (numbers - base)
        tried = base + task.least(gradients, toward)
        found = task.look(tried)
        if _size((goal - found[0])[:firm], task.worth) < ENOUGH * _size(left[:firm], task.worth):
            return tried, found, share < 1.0
        share *= 0.5
    return None


def _solve(matrix: Floats, right: Floats) -> Floats:
    """Return the solution of a covariance's system.

    A ridge distributes the error between contradicting constraints.
    """
    ridge = 1e-9 * np.diag(np.diagonal(matrix)) + 1e-300 * np.eye(len(matrix))
    return np.asarray(np.linalg.solve(matrix + ridge, right), np.float64)


def _apart(aims: Sequence[Aim], left: Floats) -> float:
    """Return the largest distance, m, among the values (k,) in metres."""
    units = [aim.unit for aim in aims for _ in aim.goal]
    places = zip(left[: len(units)], units, strict=True)
    return max((abs(value) for value, unit in places if unit == "m"), default=0.0)


def _size(left: Floats, worth: Floats) -> float:
    return float(np.sum(worth * np.square(left)))


def distance(
    scene: Scene, spread: Spread, sigma: float, numbers: Floats, aims: Sequence[Aim]
) -> float:
    """Return the Mahalanobis distance of the constraints from a motion (numbers,)."""
    looked = looking.look(aims, scene, numbers)
    return reachability.of(scene, spread, sigma, numbers, aims, looked).distance


def _met(aims: Sequence[Aim], found: Floats) -> list[Met]:
    said, start = [], 0
    for aim in aims:
        left = aim.goal - found[start : start + len(aim.goal)]
        start += len(aim.goal)
        parts = np.abs(left) if len(aim.names) > 1 else [np.linalg.norm(left)]
        said += [
            Met(name, float(miss), aim.unit, bool(miss <= MISSED))
            for name, miss in zip(aim.names, parts, strict=True)
        ]
    return said
