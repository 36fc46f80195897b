"""The smallest correction of a motion that makes it meet its aims.

Gauss-Newton on the whole correction, in the metric of how captured motions stray: each step meets
the aims as they look from where the last one led, by the least change from the prediction. A step
moves nothing by more than a stride of its own, and one that does not bring the aims nearer is
halved. What lies farther off than captured motions stray, which would take a broken pose, is
approached as far as they go.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from service.motion.answer import Met
from service.motion.conventions import Floats
from service.synthesis.exact import aims as looking
from service.synthesis.exact import reach
from service.synthesis.exact.aims import Aim, Looked
from service.synthesis.exact.feet import LOOSE
from service.synthesis.exact.scene import Scene
from service.synthesis.exact.spread import Spread

STEPS, HALVINGS = 25, 6
# m, or m/s: a hundredth of a millimetre is far below what any format keeps. Degrees likewise.
CLOSE = 1e-5
# To what a step has to bring the square of what is left.
ENOUGH = 0.98
# Farther than this, m, no linearisation is trusted.
STRIDE = 0.15
# Above this a target counts as missed, in its unit.
MISSED = 1e-3


@dataclass(frozen=True)
class Corrected:
    """Numbers of the motion that was found, what it was held to, in how many steps, and the
    distance, in standard deviations, at which the aims lay."""

    numbers: Floats
    met: tuple[Met, ...]
    steps: int
    distance: float


@dataclass(frozen=True)
class _Task:
    """What is to be met, and in which metric.

    aims: that must be met. pins: that should. worth (a,): of the aims' values in what is to become
    less. loose (k,): variance that each value is left, for a sigma of one metre: none for the aims.
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
        """Number of values that must be met."""
        return sum(len(aim.goal) for aim in self.aims)

    def look(self, numbers: Floats) -> Looked:
        """Values and gradients of aims and pins."""
        return looking.look([*self.aims, *self.pins], self.scene, numbers)

    def least(self, gradients: Floats, toward: Floats) -> Floats:
        """The least change that moves what has such gradients by so much."""
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
    """The motion nearest to a predicted one (numbers,) of standard deviation sigma, m, that meets
    the aims, or comes as near as captured motions get, and leaves pins about where they are."""
    looked = looking.look([*aims, *pins], scene, begun)
    found = reach.of(scene, spread, sigma, begun, aims, looked)
    loose = np.repeat([0.0, (LOOSE / sigma) ** 2], [len(found.left), 3 * len(pins)])
    near = looked[0][: len(found.left)] + found.way
    goal = np.concatenate([near, *(pin.goal for pin in pins)])
    task = _Task(scene, spread, begun, aims, pins, found.worth, loose)
    numbers, values, steps = _descend(task, looked, goal)
    return Corrected(numbers, tuple(_met(aims, values)), steps, found.distance)


def _descend(task: _Task, looked: Looked, goal: Floats) -> tuple[Floats, Floats, int]:
    """The corrected numbers, their values, and in how many steps."""
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
    """The next numbers with what is seen of them; None where none come nearer."""
    (values, gradients), firm = looked, task.firm
    left = goal - values
    share = min(1.0, STRIDE / max(_apart(task.aims, left), 1e-12))
    base = task.begun if whole else numbers
    if not whole:
        left[firm:] = 0.0
    for _ in range(HALVINGS):
        toward = share * left + gradients @ (numbers - base)
        tried = base + task.least(gradients, toward)
        found = task.look(tried)
        if _size((goal - found[0])[:firm], task.worth) < ENOUGH * _size(left[:firm], task.worth):
            return tried, found, share < 1.0
        share *= 0.5
    return None


def _solve(matrix: Floats, right: Floats) -> Floats:
    """Solution of a covariance's system; aims that contradict each other share the miss."""
    ridge = 1e-9 * np.diag(np.diagonal(matrix)) + 1e-300 * np.eye(len(matrix))
    return np.asarray(np.linalg.solve(matrix + ridge, right), np.float64)


def _apart(aims: Sequence[Aim], left: Floats) -> float:
    """Largest distance, m, among values (k,) of aims that are places."""
    units = [aim.unit for aim in aims for _ in aim.goal]
    places = zip(left[: len(units)], units, strict=True)
    return max((abs(value) for value, unit in places if unit == "m"), default=0.0)


def _size(left: Floats, worth: Floats) -> float:
    return float(np.sum(worth * np.square(left)))


def distance(
    scene: Scene, spread: Spread, sigma: float, numbers: Floats, aims: Sequence[Aim]
) -> float:
    """How far off aims lie from a motion (numbers,), in standard deviations."""
    looked = looking.look(aims, scene, numbers)
    return reach.of(scene, spread, sigma, numbers, aims, looked).distance


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
