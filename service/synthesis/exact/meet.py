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
from service.synthesis.exact.aims import Aim, Looked
from service.synthesis.exact.feet import LOOSE
from service.synthesis.exact.scene import Scene
from service.synthesis.exact.spread import EVEN, Spread

STEPS, HALVINGS = 25, 6
# m, or m/s: a hundredth of a millimetre is far below what any format keeps. Degrees likewise.
CLOSE = 1e-5
# Farther than this, m, no linearisation is trusted.
STRIDE = 0.15
# Standard deviations that three coordinates of a target may be off: one captured clip in 900.
FAR = 4.0
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

    aims: that must be met. pins: that should. loose (k,): variance that each value is left, for a
    sigma of one metre: none for the aims.
    """

    scene: Scene
    spread: Spread
    begun: Floats
    aims: Sequence[Aim]
    pins: Sequence[Aim]
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
    values, gradients = looking.look(aims, scene, begun)
    asked = np.concatenate([aim.goal for aim in aims])
    wanted, distance = _reachable(spread, sigma, asked - values, gradients, aims)
    loose = np.repeat([0.0, (LOOSE / sigma) ** 2], [len(asked), 3 * len(pins)])
    goal = np.concatenate([values + wanted, *(pin.goal for pin in pins)])
    numbers, steps = _descend(_Task(scene, spread, begun, aims, pins, loose), goal)
    found, _ = looking.look(aims, scene, numbers)
    return Corrected(numbers, tuple(_met(aims, found)), steps, distance)


def _descend(task: _Task, goal: Floats) -> tuple[Floats, int]:
    """The corrected numbers, and in how many steps."""
    numbers, looked = task.begun, task.look(task.begun)
    for step in range(STEPS):
        if np.abs((goal - looked[0])[: task.firm]).max() < CLOSE:
            return numbers, step
        moved = _nearer(task, numbers, looked, goal)
        if moved is None:
            return numbers, step
        numbers, looked = moved
    return numbers, STEPS


def _nearer(
    task: _Task, numbers: Floats, looked: Looked, goal: Floats
) -> tuple[Floats, Looked] | None:
    """The next numbers with what is seen of them; None where none come nearer."""
    (values, gradients), firm = looked, task.firm
    left = goal - values
    share = min(1.0, STRIDE / max(_apart(task.aims, left), 1e-12))
    worth = _worth(task.aims, task.spread.of(gradients[:firm]))
    for _ in range(HALVINGS):
        toward = share * left + gradients @ (numbers - task.begun)
        tried = task.begun + task.least(gradients, toward)
        found = task.look(tried)
        if _size((goal - found[0])[:firm], worth) < _size(left[:firm], worth):
            return tried, found
        share *= 0.5
    return None


def _solve(matrix: Floats, right: Floats) -> Floats:
    """Solution of a covariance's system; aims that contradict each other share the miss."""
    ridge = 1e-9 * np.diag(np.diagonal(matrix)) + 1e-300 * np.eye(len(matrix))
    return np.asarray(np.linalg.solve(matrix + ridge, right), np.float64)


def _worth(aims: Sequence[Aim], covariance: Floats) -> Floats:
    """Weight (k,) of each value in what is to become less: one over the mean variance of its
    aim, so that metres and degrees compare."""
    worth, start = np.empty(len(covariance)), 0
    for aim in aims:
        own = slice(start, start + len(aim.goal))
        worth[own] = 1.0 / max(float(np.diagonal(covariance)[own].mean()), 1e-12)
        start = own.stop
    return worth


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
    values, gradients = looking.look(aims, scene, numbers)
    left = np.concatenate([aim.goal for aim in aims]) - values
    covariance = sigma**2 * _evened(aims, spread.of(gradients))
    return float(np.sqrt(left @ np.linalg.solve(covariance, left)))


def far(values: int) -> float:
    """How far so many values may be off together, in standard deviations: as unlikely as FAR is for
    three (Wilson and Hilferty 1931)."""
    spread = np.sqrt(2.0 / (9.0 * 3.0))
    share = ((FAR**2 / 3.0) ** (1.0 / 3.0) - (1.0 - spread**2)) / spread
    own = np.sqrt(2.0 / (9.0 * values))
    return float(np.sqrt(values * (1.0 - own**2 + share * own) ** 3))


def _reachable(
    spread: Spread, sigma: float, left: Floats, gradients: Floats, aims: Sequence[Aim]
) -> tuple[Floats, float]:
    """What of the way (k,) to the aims captured motions go, and how far off the aims are."""
    covariance = sigma**2 * _evened(aims, spread.of(gradients))
    distance = float(np.sqrt(left @ np.linalg.solve(covariance, left)))
    limit = far(len(left))
    if distance <= limit:
        return left, distance
    # The nearest that lies within the limit: more and more of each aim's variance is added, which
    # is the method of Lagrange.
    own = np.diag(1.0 / _worth(aims, covariance))
    low, high = 0.0, 1.0
    while _reach(covariance, own, high, left)[1] > limit:
        high *= 4.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (
            (middle, high) if _reach(covariance, own, middle, left)[1] > limit else (low, middle)
        )
    return _reach(covariance, own, high, left)[0], distance


def _reach(covariance: Floats, own: Floats, more: float, left: Floats) -> tuple[Floats, float]:
    """Way with so much more variance, and how far that is."""
    solved = np.linalg.solve(covariance + more * own, left)
    way = covariance @ solved
    return way, float(np.sqrt(solved @ way))


def _evened(aims: Sequence[Aim], covariance: Floats) -> Floats:
    """Covariance with an even share for all values of an aim, so that none is nothing."""
    even = np.diag(1.0 / _worth(aims, covariance))
    return (1.0 - EVEN) * covariance + EVEN * even


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
