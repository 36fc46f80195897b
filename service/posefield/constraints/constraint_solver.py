"""Constraint solver of a model, with a cache of recent answers."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from typing import Annotated

import numpy as np

from posefield.common import cancellation
from posefield.common.errors import InvalidField, QueryError
from posefield.common.units import Floats, Frames
from posefield.common.value_cache import ValueCache
from posefield.constraints import constrained_motion, constraint
from posefield.constraints.constrained_motion import ConstrainedMotion, LevelCorrector
from posefield.constraints.constraint import Constraint, PositionConstraint
from posefield.constraints.take_variation import TakeVariation
from posefield.constraints.targets import NO_CONSTRAINTS, ConstraintSet, JointTarget, bring_back
from posefield.inference.session import PredictionState, Session
from posefield.model_file.model_card import ModelCard
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
# Canonical frames closer than this are one moment.
FRAME_TOLERANCE = 1e-3


@dataclass(frozen=True)
class _CacheKey:
    """Cache key: a question and its goals, compared by the goals and the graph's inputs."""

    question: ValidatedQuestion = field(compare=False)
    constraints: ConstraintSet
    point: bytes
    labels: bytes
    level: int


@dataclass(frozen=True)
class _OpenMotion:
    """A motion that is corrected. begun: predicted. held: by the last round."""

    key: _CacheKey
    begun: ConstrainedMotion
    held: ConstrainedMotion


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
        open_ = set(question.inferred)
        given = {name: v for name, v in question.controls.items() if name not in open_}
        given |= controls_from_targets(self._session.card, given, targets)
        if len(given) == len(question.controls):
            return given
        return self._fit_controls(question, given, targets, chooser)

    def _fit_controls(
        self,
        question: ValidatedQuestion,
        given: dict[str, float],
        targets: tuple[JointTarget, ...],
        chooser: ControlImputer,
    ) -> dict[str, float]:
        """Return the controls with which the model's prediction comes nearest to the targets.

        The first are those of a typical captured clip. The conditional mean about it is linear in
        the targets, but motions are not, so the remaining error is added to the requested positions
        in each round. It stops when the distance of the targets is within the spread of captured
        motions; a closer fit would attribute chance to the controls.
        """
        seen = np.hstack([self._positions_cached(goal.moment, goal.time) for goal in targets])
        wanted = asked = np.array([value for goal in targets for value in goal.position])
        tried: list[tuple[float, dict[str, float]]] = []
        local = chooser.near_measures(given, question.labels, seen, wanted)
        found = local.captured()
        for _ in range(MAX_ROUNDS):
            own = replace(question, controls=found, point=np.array([list(found.values())]))
            begun = self.solve(own, NO_CONSTRAINTS)
            aims = self._target_constraints(own, targets, begun)
            tried.append((self._corrector(question.level).distance(begun, aims), found))
            if tried[-1][0] <= math.sqrt(len(wanted)):
                break
            if len(tried) > 1:
                asked = asked + wanted - constraint.evaluate(aims, begun.scene, begun.numbers)[0]
            found = local(asked)
        return min(tried, key=lambda pair: pair[0])[1]

    def solve(self, question: ValidatedQuestion, found: ConstraintSet) -> ConstrainedMotion:
        """Return the motion that satisfies its constraints, as far as captured motions reach.

        Without constraints, it is the predicted motion or its take. Raises InvalidField for a
        target at a time outside the clip.
        """
        (held,) = self.solve_all([(question, found)])
        if isinstance(held, QueryError):
            raise held
        return held

    def solve_all(
        self, every: Sequence[tuple[ValidatedQuestion, ConstraintSet]]
    ) -> list[ConstrainedMotion | QueryError]:
        """Return the motions of questions as `solve` does, or the errors that it raises.

        Each has the bytes that it has alone.
        """
        keys = [
            _CacheKey(own, found, own.point.tobytes(), own.labels.tobytes(), own.level)
            for own, found in every
        ]
        return self._solved.find_all(keys, self._solve)

    def corrector(self, level: int) -> LevelCorrector:
        """Return the data for corrections at a level, computed once."""
        return self._corrector(level)

    def measured(self, question: ValidatedQuestion, held: ConstrainedMotion) -> dict[str, float]:
        """Return the measured controls of a motion."""
        return self._corrector(question.level).measured(held)

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

    def _captured_positions(
        self, moment: Measure, time: float | None
    ) -> Annotated[Floats, "samples 3"]:
        """Return a joint's predicted position (n, 3), m, at a moment of each captured clip."""
        goal = JointTarget("", moment, (0.0, 0.0, 0.0), time)
        found = []
        for state in self._captured if time is None else self._predicted(time):
            cancellation.check()
            begun = self._corrector(0).predict(state)
            aim = self._position_constraint(goal, begun, state.frames[0])
            motions = begun.scene.motion(begun.numbers).reshape(1, -1)
            # `evaluate_motions` computes the value without its gradient, which is not needed here.
            found.append(aim.evaluate_motions(begun.scene, begun.numbers, motions)[0])
        return np.array(found)

    @cached_property
    def _captured(self) -> list[PredictionState]:
        """Predictions for the captured clips; moments without a time share them."""
        return self._predicted(0.0)

    def _predicted(self, time: float) -> list[PredictionState]:
        """Return the prediction for each captured clip, with the canonical frame of a time, s."""
        card, when = self._session.card, np.array([time])
        pairs = zip(card.examples, card.clip_labels, strict=True)
        return [self._session.state(np.array([own]), when, labels[None]) for own, labels in pairs]

    def _corrector(self, level: int) -> LevelCorrector:
        if level not in self._correctors:
            self._correctors[level] = constrained_motion.build_corrector(self._session, level)
        return self._correctors[level]

    def _frames(self, question: ValidatedQuestion, held: ConstrainedMotion, when: Frames) -> Frames:
        """Return the canonical frames (S,) of times (S,), s, scaled by a corrected duration."""
        shares = when * (held.state.duration / held.duration)
        own = self._session.state(question.point, shares, question.labels, question.level)
        return own.frames

    def _solve(self, keys: Sequence[_CacheKey]) -> list[ConstrainedMotion | QueryError]:
        """Return the motions of questions, or their errors."""
        found = [self._begun(key) for key in keys]
        open_ = [_OpenMotion(key, held, held) for key, held in zip(keys, found, strict=True)]
        open_ = [own for own in open_ if own.key.constraints.corrects]
        held = {id(own.key): own.held for own in self._corrected(open_)}
        return [
            self._checked(key, held[id(key)]) if id(key) in held else begun
            for key, begun in zip(keys, found, strict=True)
        ]

    def _begun(self, key: _CacheKey) -> ConstrainedMotion:
        """Return the predicted motion of a question, or its take."""
        question, bench = key.question, self._corrector(key.level)
        state = self._session.state(question.point, np.zeros(1), question.labels, key.level)
        begun = bench.predict(state)
        take = key.constraints.take
        return self.variation.vary(bench, begun, question, take) if take else begun

    def _corrected(self, every: Sequence[_OpenMotion]) -> list[_OpenMotion]:
        """Return the motions, corrected: in rounds, as targets at times move with the duration."""
        done: list[_OpenMotion] = []
        for _ in range(MAX_ROUNDS):
            if not every:
                break
            moved = self._next_round(every)
            settled = [
                abs(new.held.duration / old.held.duration - 1.0) < DURATION_TOLERANCE
                for old, new in zip(every, moved, strict=True)
            ]
            done += [own for own, ends in zip(moved, settled, strict=True) if ends]
            every = [own for own, ends in zip(moved, settled, strict=True) if not ends]
        return [*done, *every]

    def _next_round(self, every: Sequence[_OpenMotion]) -> list[_OpenMotion]:
        """Return the motions, corrected with their targets where the last round places them."""
        found: dict[int, ConstrainedMotion] = {}
        levels = [own.key.level for own in every]
        for level in dict.fromkeys(levels):
            places = [place for place, own in enumerate(levels) if own == level]
            tasks = [(every[place].begun, self._aims(every[place])) for place in places]
            found |= zip(places, self._corrector(level).solve_all(tasks), strict=True)
        return [replace(own, held=found[place]) for place, own in enumerate(every)]

    def _aims(self, own: _OpenMotion) -> list[Constraint]:
        goals, frames = own.key.constraints, own.begun.scene.reduced.frames
        aims = constraint.from_controls(goals.controls, frames)
        aimed = self._target_constraints(own.key.question, goals.targets, own.held)
        return [*self._without_targeted(aims, aimed, frames - 1.0), *aimed]

    def _checked(self, key: _CacheKey, held: ConstrainedMotion) -> ConstrainedMotion | QueryError:
        """Return a corrected motion within the bounds, or the error of one of its targets."""
        question, goals = key.question, key.constraints
        bench, bounds = self._corrector(key.level), self._session.bounds
        if not bounds.is_inside(question.point):
            held = bring_back(bench, held, goals, question.controls, bounds)
        try:
            self._check_times(goals.targets, held)
            aimed = self._target_constraints(question, goals.targets, held)
            _check_duplicates(aimed, bench.reduced.frames - 1.0)
        except QueryError as fault:
            return fault
        return held

    def _without_targeted(
        self, aims: Sequence[Constraint], targets: Sequence[PositionConstraint], last: float
    ) -> list[Constraint]:
        """Return the constraints without those of a joint that a target places at the same frame.

        The target is more specific than the control.
        """
        return [
            aim
            for aim in aims
            if not (
                isinstance(aim, PositionConstraint)
                and any(_same_joints_and_frame(aim, own, last) for own in targets)
            )
        ]

    def _target_constraints(
        self, question: ValidatedQuestion, targets: tuple[JointTarget, ...], held: ConstrainedMotion
    ) -> list[PositionConstraint]:
        """Return the constraints of targets, at the canonical frames of the given motion."""
        # The duration is known only after the correction; times beyond the longest plausible clip
        # are limited because they may overflow float32.
        longest = question_validation.duration_range(self._session.card)[1]
        times = np.array([min(goal.time or 0.0, longest) for goal in targets])
        timed = self._frames(question, held, times) if len(times) else times
        pairs = zip(targets, timed.tolist(), strict=True)
        return [self._position_constraint(goal, held, frame) for goal, frame in pairs]

    def _position_constraint(
        self, goal: JointTarget, held: ConstrainedMotion, frame: float
    ) -> PositionConstraint:
        """Return the constraint of a target; frame: canonical frame of its time, if it has one."""
        last = held.scene.reduced.frames - 1
        at = (goal.moment.share or 0.0) * last if goal.time is None else frame
        return PositionConstraint((goal.name,), goal.moment, (0, 1, 2), np.array(goal.position), at)

    def _check_times(self, targets: tuple[JointTarget, ...], held: ConstrainedMotion) -> None:
        for index, goal in enumerate(targets):
            if goal.time is not None:
                field = f"targets/{index}/time"
                motion_question.check_rounded_range(field, goal.time, 0.0, held.duration, "s")


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
    card: ModelCard, given: Mapping[str, float], goals: tuple[JointTarget, ...]
) -> dict[str, float]:
    """Return values of controls that targets determine, limited to the sampled ranges.

    The targets remain constraints.
    """
    found = {}
    for goal in goals:
        for control in card.controls:
            own = control.measure
            if control.name in given or own is None or own.quantity not in POSITION_AXES:
                continue
            same = (own.joints, own.at, own.share) == (
                goal.moment.joints,
                goal.moment.at,
                goal.moment.share,
            )
            if same and goal.time is None:
                value = float(goal.position[POSITION_AXES[own.quantity]])
                # Beyond the sampled range, the correction approaches the target, not the model's
                # extrapolation.
                found[control.name] = min(max(value, control.minimum), control.maximum)
    return found
