"""Answers corrected to the captured position of the event's joint by the service's solver.

Each correction is measured, also for targets that are farther away than the captured position.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from posefield.common.units import Floats
from posefield.constraints import constrained_motion
from posefield.constraints.constrained_motion import Bench, Held
from posefield.constraints.constraint import Place
from posefield.inference import session
from posefield.inference.graph_ports import OUTPUTS
from posefield.inference.session import Session, State
from posefield.motion import skeleton
from posefield.motion.measures import Measure
from posefield_train.evaluate import compared_motion, motion_errors
from posefield_train.evaluate.compared_motion import EVEN, Event, Motion
from posefield_train.evaluate.methods import Asked
from posefield_train.graph.trained_model import Trained
from posefield_train.kriging import sample_points
from posefield_train.source.recipe import Recipe
from posefield_train.tensor import truncation_error

# Distances beyond the captured position, away from the root, m: possibly and certainly unreachable.
BEYOND, FAR = (0.1, 0.2, 0.3), 1.0


@dataclass(frozen=True)
class Goal:
    """Captured positions at the event. joint: of the event's joint (3,), m. root: (3,), m."""

    joint: Floats
    root: Floats

    def farther(self, metres: float) -> Floats:
        """Return the joint's position moved away from the root (3,), m."""
        away = self.joint - self.root
        return np.asarray(self.joint + metres * away / np.linalg.norm(away), np.float64)


@dataclass(frozen=True)
class Correction:
    """Correction of one clip.

    steps: of the solver. distance: from prediction to target, in standard deviations. reached: True
    if the target counts as reachable. beyond: the same for targets BEYOND it; empty if the event's
    joint is the root. acceleration: after over before. seconds: thread time with the prediction.
    plain_seconds: of the prediction alone. far: None if the event's joint is the root.
    """

    steps: int
    distance: float
    reached: bool
    beyond: tuple[bool, ...]
    acceleration: float
    seconds: float
    plain_seconds: float
    far: "Far | None"


@dataclass(frozen=True)
class Far:
    """Correction to a target FAR beyond the captured position.

    reached: True if the target counts as reachable. acceleration: after over before. root: movement
    of the root, m. steps: of the solver.
    """

    reached: bool
    acceleration: float
    root: float
    steps: int


@dataclass(frozen=True)
class Exact:
    """Corrected motions and their corrections."""

    motions: list[Motion]
    corrections: list[Correction]


@dataclass(frozen=True)
class _Desk:
    """An opened model, its constraint solver, and the event."""

    opened: Session
    bench: Bench
    event: truncation_error.Moment

    def state(self, controls: Floats, labels: Floats) -> State:
        """Return the state at even shares of the duration."""
        durations = self.opened.durations(controls, labels)
        return self.opened.state(controls, EVEN * durations, labels)

    def held(self, begun: Held, place: Floats) -> Held:
        """Return the motion with the event's joint at a position (3,) at the event."""
        own = Measure("height", (self.event.joint,), "landmark")
        return self.bench.held(begun, [Place(("event",), own, (0, 1, 2), place, self.event.frame)])

    def motion(self, held: Held) -> Motion:
        """Return a corrected motion as it is compared."""
        state, parents = held.state, self.opened.card.skeleton.parents
        rotations, path = held.poses(state.frames)
        translations = skeleton.translations(state.bones, path)
        share = float(np.interp(self.event.frame, state.frames, EVEN))
        own = Event(self.event.joint, share)
        return compared_motion.posed(parents, rotations, translations, held.duration, own)


def goal(captured: Motion, event: Event) -> Goal:
    """Return the target that a captured motion gives."""
    return Goal(event.of(captured.joints), Event(0, event.share).of(captured.joints))


def answers(
    recipe: Recipe, trained: Trained, file: bytes, asked: Asked, wanted: Sequence[Goal]
) -> Exact:
    """Return the answers of a model file, each corrected to its target."""
    event = truncation_error.moment(recipe, trained.examples)
    assert event is not None
    opened = session.open_bytes(file, recipe.name)
    desk = _Desk(opened, constrained_motion.bench(opened, 0), event)
    labels = sample_points.labels(asked.performers, opened.card.performers)
    clips = zip(asked.controls[:, None], labels[:, None], wanted, strict=True)
    motions, corrections = zip(*(_corrected(desk, *clip) for clip in clips), strict=True)
    return Exact(list(motions), list(corrections))


def _corrected(
    desk: _Desk, controls: Floats, labels: Floats, wanted: Goal
) -> tuple[Motion, Correction]:
    begun = desk.bench.begun(desk.state(controls, labels))
    held = desk.held(begun, wanted.joint)
    before, after = desk.motion(begun), desk.motion(held)
    # The root cannot be moved away from itself.
    outward = desk.event.joint != 0
    beyond = [desk.held(begun, wanted.farther(metres)) for metres in BEYOND if outward]
    correction = Correction(
        held.steps,
        held.distance,
        _reached(held),
        tuple(map(_reached, beyond)),
        _rougher(after, before),
        _seconds(lambda: _clip(desk, controls, labels, wanted)),
        _seconds(lambda: _plain(desk, controls, labels)),
        _far(desk, begun, before, wanted) if outward else None,
    )
    return after, correction


def _clip(desk: _Desk, controls: Floats, labels: Floats, wanted: Goal) -> None:
    state = desk.state(controls, labels)
    desk.held(desk.bench.begun(state), wanted.joint).poses(state.frames)


def _plain(desk: _Desk, controls: Floats, labels: Floats) -> None:
    times = EVEN * desk.opened.durations(controls, labels)[:, None]
    desk.opened.run(controls, times, *OUTPUTS, labels=labels)


def _seconds(run: Callable[[], None]) -> float:
    # The first call includes one-time work; thread time excludes other work of the machine.
    run()
    start = time.thread_time()
    run()
    return time.thread_time() - start


def _far(desk: _Desk, begun: Held, before: Motion, wanted: Goal) -> Far:
    held = desk.held(begun, wanted.farther(FAR))
    after = desk.motion(held)
    moved = np.linalg.norm(after.joints[:, 0] - before.joints[:, 0], axis=-1)
    return Far(_reached(held), _rougher(after, before), float(moved.max()), held.steps)


def _rougher(after: Motion, before: Motion) -> float:
    return motion_errors.acceleration(after.points) / motion_errors.acceleration(before.points)


def _reached(held: Held) -> bool:
    return all(met.reached for met in held.met)
