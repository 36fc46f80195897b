"""Predictions corrected to the captured position of the event's joint by the service's solver.

Each correction is measured, also for targets that are farther away than the captured position.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from evaluation.methods import EXACT
from posefield.common.units import Floats
from posefield.constraints import gauss_newton
from posefield.constraints.constrained_motion import ConstrainedMotion
from posefield.constraints.constraint import PositionConstraint
from posefield.constraints.gauss_newton import LevelCorrector
from posefield.inference import session
from posefield.inference.onnx_runtime import OUTPUTS
from posefield.inference.session import PredictionState, Session
from posefield.motion import skeleton
from posefield.motion.measures import Measure
from posefield_train.evaluate import motion_errors
from posefield_train.evaluate.motion_errors import ComparedMotion, MotionErrors, MotionEvent
from posefield_train.evaluate.predictions import OURS, Queries
from posefield_train.evaluate.protocol import EvaluationResult
from posefield_train.graph.trained_model import TrainedModel
from posefield_train.kriging import sample_points
from posefield_train.report.significant_digits import round_number
from posefield_train.source.recipe import Recipe
from posefield_train.tensor import truncation_error
from posefield_train.tensor.motion_tensor import UNIFORM_SHARES

# Distances beyond the captured position, away from the root, m: possibly and certainly unreachable.
BEYOND_DISTANCES, FAR = (0.1, 0.2, 0.3), 1.0


@dataclass(frozen=True)
class EventTarget:
    """Captured positions at the event. joint: of the event's joint (3,), m. root: (3,), m."""

    joint: Floats
    root: Floats

    def moved_outward(self, metres: float) -> Floats:
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
class _MotionCorrector:
    """An opened model, its constraint solver, and the event."""

    opened: Session
    corrector: LevelCorrector
    event: truncation_error.EventFrame

    def state(self, controls: Floats, labels: Floats) -> PredictionState:
        """Return the state at even shares of the duration."""
        (durations,) = self.opened.run(controls, None, "duration", labels=labels)
        return self.opened.state(controls, UNIFORM_SHARES * durations, labels)

    def held(self, predicted: ConstrainedMotion, position: Floats) -> ConstrainedMotion:
        """Return the motion with the event's joint at a position (3,) at the event."""
        measure = Measure("height", (self.event.joint,), "landmark")
        aim = PositionConstraint(("event",), measure, (0, 1, 2), position, self.event.frame)
        (corrected,) = self.corrector.solve_all([(predicted, [aim])])
        return corrected

    def motion(self, corrected: ConstrainedMotion) -> ComparedMotion:
        """Return a corrected motion as it is compared."""
        state, parents = corrected.state, self.opened.card.skeleton.parents
        rotations, path = corrected.poses(state.frames)
        translations = skeleton.translations(state.bones, path)
        share = float(np.interp(self.event.frame, state.frames, UNIFORM_SHARES))
        event = MotionEvent(self.event.joint, share)
        motion = motion_errors.motion_of_poses(
            parents, rotations, translations, corrected.duration, event
        )
        curves = self.opened.card.curves
        values = corrected.curve_values(state.frames) if curves else np.zeros(0)
        return motion_errors.with_curves([motion], curves, values[None])[0]


def event_target(captured: ComparedMotion, event: MotionEvent) -> EventTarget:
    """Return the target that a captured motion gives."""
    return EventTarget(
        event.position_of(captured.joints), MotionEvent(0, event.share).position_of(captured.joints)
    )


def correct_motions(
    recipe: Recipe,
    trained: TrainedModel,
    file: bytes,
    queries: Queries,
    target: Sequence[EventTarget],
) -> tuple[list[ComparedMotion], list[Correction]]:
    """Return the predictions of a model file, each corrected to its target, and the corrections."""
    event = truncation_error.event_frame(recipe, trained.examples)
    assert event is not None
    opened = session.open_bytes(file, recipe.name)
    desk = _MotionCorrector(opened, gauss_newton.build_corrector(opened, 0), event)
    label_names = {label_set.name: label_set.names for label_set in opened.card.labels}
    labels = sample_points.label_weights(queries.labels, label_names)
    clips = zip(queries.controls[:, None], labels[:, None], target, strict=True)
    motions, corrections = zip(*(_correct(desk, *clip) for clip in clips), strict=True)
    return list(motions), list(corrections)


def _correct(
    desk: _MotionCorrector, controls: Floats, labels: Floats, target: EventTarget
) -> tuple[ComparedMotion, Correction]:
    predicted = desk.corrector.predict(desk.state(controls, labels))
    corrected = desk.held(predicted, target.joint)
    before, after = desk.motion(predicted), desk.motion(corrected)
    # The root cannot be moved away from itself.
    outward = desk.event.joint != 0
    beyond = [
        desk.held(predicted, target.moved_outward(metres)) for metres in BEYOND_DISTANCES if outward
    ]
    correction = Correction(
        corrected.steps,
        corrected.distance,
        _is_reachable(corrected),
        tuple(map(_is_reachable, beyond)),
        _acceleration_ratio(after, before),
        _thread_seconds(lambda: _run_corrected(desk, controls, labels, target)),
        _thread_seconds(lambda: _run_uncorrected(desk, controls, labels)),
        _correct_far(desk, predicted, before, target) if outward else None,
    )
    return after, correction


def _run_corrected(
    desk: _MotionCorrector, controls: Floats, labels: Floats, target: EventTarget
) -> None:
    state = desk.state(controls, labels)
    desk.held(desk.corrector.predict(state), target.joint).poses(state.frames)


def _run_uncorrected(desk: _MotionCorrector, controls: Floats, labels: Floats) -> None:
    (durations,) = desk.opened.run(controls, None, "duration", labels=labels)
    times = UNIFORM_SHARES * durations[:, None]
    desk.opened.run(controls, times, *OUTPUTS, labels=labels)


def _thread_seconds(run: Callable[[], None]) -> float:
    # The first call includes one-time work; thread time excludes other work of the machine.
    run()
    start = time.thread_time()
    run()
    return time.thread_time() - start


def _correct_far(
    desk: _MotionCorrector, started: ConstrainedMotion, before: ComparedMotion, target: EventTarget
) -> Far:
    corrected = desk.held(started, target.moved_outward(FAR))
    after = desk.motion(corrected)
    distances = np.linalg.norm(after.joints[:, 0] - before.joints[:, 0], axis=-1)
    return Far(
        _is_reachable(corrected),
        _acceleration_ratio(after, before),
        float(distances.max()),
        corrected.steps,
    )


def _acceleration_ratio(after: ComparedMotion, before: ComparedMotion) -> float:
    one, other = (motion_errors.frame_accelerations(own.points).mean() for own in (after, before))
    return float(one / other)


def _is_reachable(corrected: ConstrainedMotion) -> bool:
    return all(met.reached for met in corrected.results)


def facts(result: EvaluationResult, corrections: Sequence[Correction]) -> dict[str, float]:
    """Return the figures by name: centimetres, milliseconds, shares; with the worst clip's."""

    def of(value: Callable[[Correction], float]) -> Floats:
        return np.array([float(value(correction)) for correction in corrections])

    before, after = result.of(OURS), result.of(EXACT)
    spread = {
        "effector_cm": 100.0 * np.array([error.effector for error in after]),
        "steps": of(lambda c: c.steps),
        "acceleration": of(lambda c: c.acceleration),
        "distance": of(lambda c: c.distance),
    }
    # Medians, because single clips are delayed by other work of the machine.
    plain = {
        "relative_change": _change(before, after, "relative"),
        "global_change": _change(before, after, "absolute"),
        "ms": 1e3 * np.median(of(lambda c: c.seconds)),
        "plain_ms": 1e3 * np.median(of(lambda c: c.plain_seconds)),
        "out_of_reach": np.mean(of(lambda c: not c.reached)),
    }
    for index, metres in enumerate(BEYOND_DISTANCES[: len(corrections[0].beyond)]):
        missing = [not correction.beyond[index] for correction in corrections]
        plain[f"out_of_reach_{round(100 * metres)}cm"] = np.mean(missing)
    if far := [correction.far for correction in corrections if correction.far]:
        plain["far_out_of_reach"] = np.mean([not one.reached for one in far])
        spread["far_acceleration"] = np.array([one.acceleration for one in far])
        spread["far_root_cm"] = 100.0 * np.array([one.root for one in far])
        spread["far_steps"] = np.array([float(one.steps) for one in far])
    means = {name: round_number(values.mean()) for name, values in spread.items()}
    worst = {f"{name}_worst": round_number(values.max()) for name, values in spread.items()}
    return means | worst | {name: round_number(value) for name, value in plain.items()}


def _change(before: Sequence[MotionErrors], after: Sequence[MotionErrors], distance: str) -> Any:
    """Return the change of a mean distance, as a share of that without correction."""
    means = [
        np.mean([getattr(error, distance).mean for error in errors]) for errors in (after, before)
    ]
    return means[0] / means[1] - 1.0
