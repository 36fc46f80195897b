"""Constraint solver of a model, with a cache of recent answers."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property, lru_cache
from typing import Annotated

import numpy as np

from posefield.common import cancellation
from posefield.common.errors import InvalidField, QueryError
from posefield.common.units import Floats, Frames
from posefield.common.value_cache import ValueCache
from posefield.constraints import constrained_motion, constraint, gauss_newton
from posefield.constraints.constrained_motion import ConstrainedMotion
from posefield.constraints.constraint import Constraint, PositionConstraint
from posefield.constraints.gauss_newton import LevelCorrector
from posefield.constraints.take_variation import TakeVariation
from posefield.constraints.targets import NO_CONSTRAINTS, ConstraintSet, JointTarget, bring_back
from posefield.inference.session import PredictionState, Session
from posefield.model_file.model_card import ModelCard
from posefield.motion import cycle_velocities
from posefield.motion.measures import POSITION_AXES, Measure
from posefield.question import motion_question
from posefield.question.results import PoseAnswer, Trust
from posefield.validation import question_validation
from posefield.validation.imputation import ControlImputer
from posefield.validation.question_validation import ValidatedQuestion

# Number of cached motions, for clients that play a clip pose by pose or alternate between a few.
CACHE_SIZE = 64
# A speed constraint changes the duration, and so the canonical frame of a time in seconds: the most
# iterations, and the relative change of the duration at which they stop.
MAX_ROUNDS, DURATION_TOLERANCE = 8, 1e-6
# Times at which the canonical frames of a motion are looked up, to find the time of one.
WARP_STEPS = 2048
# Canonical frames closer than this are one moment.
FRAME_TOLERANCE = 1e-3


_CacheKey = tuple[ConstraintSet, bytes, bytes, int]
"""Constraints, and the controls, labels and level of the graph's input."""


class ConstraintSolver:
    """Constraint solver of one model."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self.variation = TakeVariation(session)
        self._correctors: dict[int, LevelCorrector] = {}
        self._solved = ValueCache[_CacheKey, ConstrainedMotion | QueryError](CACHE_SIZE)
        self._positions_cached = lru_cache(CACHE_SIZE)(self._captured_positions)

    def controls(
        self,
        question: ValidatedQuestion,
        targets: tuple[JointTarget, ...],
        chooser: ControlImputer,
    ) -> dict[str, float]:
        """Return all controls of a question with open controls and targets.

        The open controls are near those of a captured clip that is typical for the other controls
        and the targets.
        """
        inferred = set(question.inferred)
        values = {name: v for name, v in question.controls.items() if name not in inferred}
        values |= controls_from_targets(self._session.card, values, targets)
        if len(values) == len(question.controls):
            return values
        return self._fit_controls(question, values, targets, chooser)

    def _fit_controls(
        self,
        question: ValidatedQuestion,
        fixed: dict[str, float],
        targets: tuple[JointTarget, ...],
        chooser: ControlImputer,
    ) -> dict[str, float]:
        """Return the controls with which the model's prediction comes nearest to the targets.

        The first are those of a typical captured clip. The conditional mean about it is linear in
        the targets, but motions are not, so the remaining error is added to the requested positions
        in each round. It stops when the distance of the targets is within the spread of captured
        motions; a closer fit would attribute chance to the controls.
        """
        captured = np.hstack([self._positions_cached(goal.moment, goal.time) for goal in targets])
        goals = shifted = np.array([value for goal in targets for value in goal.position])
        tried: list[tuple[float, dict[str, float]]] = []
        impute = chooser.near_measures(fixed, question.labels, captured, goals)
        controls = impute.captured()
        for _ in range(MAX_ROUNDS):
            complete = replace(
                question, controls=controls, point=np.array([list(controls.values())])
            )
            motion = self.solve(complete, NO_CONSTRAINTS)
            aims = self._target_constraints(complete, targets, motion)
            tried.append((self.corrector(question.level).distance(motion, aims), controls))
            if tried[-1][0] <= math.sqrt(len(goals)):
                break
            if len(tried) > 1:
                shifted = (
                    shifted + goals - constraint.evaluate(aims, motion.scene, motion.numbers)[0]
                )
            controls = impute(shifted)
        return min(tried, key=lambda pair: pair[0])[1]

    def solve(self, question: ValidatedQuestion, constraints: ConstraintSet) -> ConstrainedMotion:
        """Return the motion that satisfies its constraints, as far as captured motions reach.

        Without constraints, it is the predicted motion or its take. Raises InvalidField for a
        target at a time outside the clip.
        """
        (motion,) = self.solve_all([(question, constraints)])
        if isinstance(motion, QueryError):
            raise motion
        return motion

    def solve_all(
        self, questions: Sequence[tuple[ValidatedQuestion, ConstraintSet]]
    ) -> list[ConstrainedMotion | QueryError]:
        """Return the motions of questions as `solve` does, or the errors that it raises.

        Each has the bytes that it has alone.
        """
        keys = [
            (constraints, question.point.tobytes(), question.labels.tobytes(), question.level)
            for question, constraints in questions
        ]
        by_key = dict(zip(keys, questions, strict=True))

        def solve(missing: list[_CacheKey]) -> list[ConstrainedMotion | QueryError]:
            return self._solve([by_key[key] for key in missing])

        return self._solved.find_all(keys, solve)

    def corrector(self, level: int) -> LevelCorrector:
        """Return the data for corrections at a level, computed once."""
        if level not in self._correctors:
            self._correctors[level] = gauss_newton.build_corrector(self._session, level)
        return self._correctors[level]

    def poses(
        self, requests: Sequence[tuple[ValidatedQuestion, ConstrainedMotion, Frames, Trust]]
    ) -> list[PoseAnswer[np.float64]]:
        """Return the poses of motions at times (S,), s, with the given trust.

        Each has the bytes that it has alone.
        """
        frames = [self._frames(*request[:3]) for request in requests]
        poses = constrained_motion.evaluate_poses([motion for _, motion, _, _ in requests], frames)
        with_curves = bool(self._session.card.curves)
        return [
            PoseAnswer(
                times,
                rotations,
                roots,
                motion.state.bones,
                trust,
                motion.curve_values(at) if with_curves else None,
            )
            for (_, motion, times, trust), at, (rotations, roots) in zip(
                requests, frames, poses, strict=True
            )
        ]

    def target_times(
        self,
        question: ValidatedQuestion,
        motion: ConstrainedMotion,
        targets: tuple[JointTarget, ...],
    ) -> list[float]:
        """Return the times, s, at which a motion has the moments of targets."""
        aims = self._target_constraints(question, targets, motion)
        frames = np.array([aim.frame_of(motion.scene, motion.numbers) for aim in aims])
        times = self.times(question, motion, frames).tolist()
        return [
            time if target.time is None else min(target.time, motion.duration)
            for target, time in zip(targets, times, strict=True)
        ]

    def times(
        self, question: ValidatedQuestion, motion: ConstrainedMotion, frames: Frames
    ) -> Frames:
        """Return the times (S,), s, of canonical frames (S,) of a motion."""
        times = np.linspace(0.0, motion.duration, WARP_STEPS)
        return np.interp(frames, self._frames(question, motion, times), times)

    def _captured_positions(
        self, moment: Measure, time: float | None
    ) -> Annotated[Floats, "samples 3"]:
        """Return a joint's predicted position (n, 3), m, at a moment of each captured clip."""
        goal = JointTarget("", moment, (0.0, 0.0, 0.0), time)
        positions = []
        for state in self._captured if time is None else self._predicted(time):
            cancellation.check()
            motion = self.corrector(0).predict(state)
            aim = self._position_constraint(goal, motion, state.frames[0])
            motions = motion.scene.motion(motion.numbers).reshape(1, -1)
            # `evaluate_motions` computes the value without its gradient, which is not needed here.
            positions.append(aim.evaluate_motions(motion.scene, motion.numbers, motions)[0])
        return np.array(positions)

    @cached_property
    def _captured(self) -> list[PredictionState]:
        """Predictions for the captured clips; moments without a time share them."""
        return self._predicted(0.0)

    def _predicted(self, time: float) -> list[PredictionState]:
        """Return the prediction for each captured clip, with the canonical frame of a time, s."""
        card, when = self._session.card, np.array([time])
        pairs = zip(card.examples, card.clip_labels, strict=True)
        return [
            self._session.state(np.array([controls]), when, labels[None])
            for controls, labels in pairs
        ]

    def _frames(
        self, question: ValidatedQuestion, motion: ConstrainedMotion, times: Frames
    ) -> Frames:
        """Return the canonical frames (S,) of times (S,), s, scaled by a corrected duration."""
        shares = times * (motion.state.duration / motion.duration)
        state = self._session.state(question.point, shares, question.labels, question.level)
        return state.frames

    def _solve(
        self, questions: Sequence[tuple[ValidatedQuestion, ConstraintSet]]
    ) -> list[ConstrainedMotion | QueryError]:
        """Return the motions of questions, or their errors."""
        first = [self._uncorrected(*question) for question in questions]
        motions = first.copy()
        moving = [row for row, (_, constraints) in enumerate(questions) if constraints.corrects]
        for _ in range(MAX_ROUNDS):
            # Targets at times move with the duration.
            durations = [motion.duration for motion in motions]
            for level in dict.fromkeys(questions[row][0].level for row in moving):
                rows = [row for row in moving if questions[row][0].level == level]
                tasks = [(first[row], self._aims(*questions[row], motions[row])) for row in rows]
                for row, motion in zip(rows, self.corrector(level).solve_all(tasks), strict=True):
                    motions[row] = motion
            moving = [
                row
                for row in moving
                if not abs(motions[row].duration / durations[row] - 1.0) < DURATION_TOLERANCE
            ]
            if not moving:
                break
        return [
            self._checked(*question, motion) if question[1].corrects else motion
            for question, motion in zip(questions, motions, strict=True)
        ]

    def _uncorrected(
        self, question: ValidatedQuestion, constraints: ConstraintSet
    ) -> ConstrainedMotion:
        """Return the predicted motion of a question, or its take."""
        corrector = self.corrector(question.level)
        state = self._session.state(question.point, np.zeros(1), question.labels, question.level)
        motion, take = _at_velocities(corrector.predict(state), constraints), constraints.take
        varied = self.variation.vary(corrector, motion, question, take) if take else motion
        return _at_velocities(varied, constraints) if take else motion

    def _aims(
        self, question: ValidatedQuestion, constraints: ConstraintSet, motion: ConstrainedMotion
    ) -> list[Constraint]:
        """Return the constraints, with targets where a motion of the last round has them.

        Controls lack those of a joint that a target places at the same frame, which is more
        specific.
        """
        frames = motion.scene.reduced.frames
        targets = self._target_constraints(question, constraints.targets, motion)
        controls = [
            aim
            for aim in constraint.from_controls(constraints.controls, frames)
            if not (
                isinstance(aim, PositionConstraint)
                and any(_same_joints_and_frame(aim, target, frames - 1.0) for target in targets)
            )
        ]
        return [*controls, *targets]

    def _checked(
        self, question: ValidatedQuestion, constraints: ConstraintSet, motion: ConstrainedMotion
    ) -> ConstrainedMotion | QueryError:
        """Return a corrected motion within the bounds, or the error of one of its targets."""
        corrector, bounds = self.corrector(question.level), self._session.bounds
        if not bounds.is_inside(question.point):
            motion = bring_back(corrector, motion, constraints, question.controls, bounds)
        try:
            for index, target in enumerate(constraints.targets):
                if target.time is not None:
                    field = f"targets/{index}/time"
                    latest = motion.duration + target.slack
                    motion_question.check_rounded_range(field, target.time, 0.0, latest, "s")
            aims = self._target_constraints(question, constraints.targets, motion)
            _check_duplicates(aims, corrector.reduced.frames - 1.0)
        except QueryError as error:
            return error
        return motion

    def _target_constraints(
        self,
        question: ValidatedQuestion,
        targets: tuple[JointTarget, ...],
        motion: ConstrainedMotion,
    ) -> list[PositionConstraint]:
        """Return the constraints of targets, at the canonical frames of the given motion."""
        # The duration is known only after the correction; times beyond the longest plausible clip
        # are limited because they may overflow float32.
        longest = question_validation.duration_range(self._session.card)[1]
        times = np.array([min(goal.time or 0.0, longest) for goal in targets])
        timed = self._frames(question, motion, times) if len(times) else times
        pairs = zip(targets, timed.tolist(), strict=True)
        return [self._position_constraint(goal, motion, frame) for goal, frame in pairs]

    def _position_constraint(
        self, goal: JointTarget, motion: ConstrainedMotion, frame: float
    ) -> PositionConstraint:
        """Return the constraint of a target; frame: canonical frame of its time, if it has one."""
        last = motion.scene.reduced.frames - 1
        at = (goal.moment.share or 0.0) * last if goal.time is None else frame
        return PositionConstraint((goal.name,), goal.moment, (0, 1, 2), np.array(goal.position), at)


def _at_velocities(motion: ConstrainedMotion, constraints: ConstraintSet) -> ConstrainedMotion:
    """Return a prediction or take with its travel at the velocities among the constraints."""
    goals = {str(measure.quantity): goal for _, measure, goal in constraints.controls}
    names, numbers, scene = cycle_velocities.QUANTITIES, motion.numbers.copy(), motion.scene
    chosen = np.array([1.0 * (name in goals) for name in names])
    if chosen.any():
        velocities = np.array([goals.get(name, 0.0) for name in names])
        numbers[-len(names) :] = cycle_velocities.matched(
            np, motion.travel, np.float64(motion.duration), velocities, chosen
        )
        scene = scene if motion.is_take else replace(scene, predicted=numbers)
    return replace(motion, scene=scene, numbers=numbers)


def _same_joints_and_frame(a: PositionConstraint, b: PositionConstraint, last: float) -> bool:
    """Return whether two constraints are on the same joints at one frame.

    False for moments that the motion determines.
    """
    at, other = a.frame(last), b.frame(last)
    if a.moment.joints != b.moment.joints or at is None or other is None:
        return False
    return abs(at - other) < FRAME_TOLERANCE


def _check_duplicates(targets: Sequence[PositionConstraint], last: float) -> None:
    """Raise InvalidField for a second target of a joint at a time that maps to the same frame."""
    for later, aim in enumerate(targets):
        for earlier, other in enumerate(targets[:later]):
            if _same_joints_and_frame(aim, other, last):
                raise InvalidField(
                    f"targets/{later}",
                    f"{aim.names[0]} has a target already (targets/{earlier}: {other.names[0]}), "
                    "expected one",
                )


def controls_from_targets(
    card: ModelCard, known_controls: Mapping[str, float], goals: tuple[JointTarget, ...]
) -> dict[str, float]:
    """Return values of controls that targets determine, limited to the sampled ranges.

    The targets remain constraints.
    """
    values = {}
    for goal in goals:
        for control in card.controls:
            measure = control.measure
            if (
                control.name in known_controls
                or measure is None
                or measure.quantity not in POSITION_AXES
            ):
                continue
            same = (measure.joints, measure.at, measure.share) == (
                goal.moment.joints,
                goal.moment.at,
                goal.moment.share,
            )
            if same and goal.time is None:
                value = float(goal.position[POSITION_AXES[measure.quantity]])
                # Beyond the sampled range, the correction approaches the target, not the model's
                # extrapolation.
                values[control.name] = min(max(value, control.minimum), control.maximum)
    return values
