"""Constraint solver of a model, with a cache of recent answers."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache

import numpy as np

from posefield.common import cancellation
from posefield.common.errors import InvalidField
from posefield.common.units import Floats
from posefield.constraints import constrained_motion
from posefield.constraints import constraint as looking
from posefield.constraints import targets as goals
from posefield.constraints.constrained_motion import Bench, Held
from posefield.constraints.constraint import Aim, Place
from posefield.constraints.targets import NOTHING, Goal, Goals
from posefield.inference.session import Session, State
from posefield.model_file.model_card import ModelCard
from posefield.motion.measures import AXES, Measure
from posefield.question import value_validation
from posefield.question.motion_question import MotionQuestion
from posefield.question.results import PoseAnswer, Trust
from posefield.validation import input_limits
from posefield.validation.imputation import Chooser
from posefield.validation.question_validation import Question

# Number of cached motions, for clients that play a clip pose by pose or alternate between a few.
KEPT = 64
# A speed constraint changes the duration, and so the canonical frame of a time in seconds: the most
# iterations, and the relative change of the duration at which they stop.
ROUNDS, SAME = 8, 1e-6
# Canonical frames closer than this are one moment.
TWINS = 1e-3


@dataclass(frozen=True)
class _Asked:
    """Cache key: a question and its goals, compared by the goals and the graph's inputs."""

    question: Question = field(compare=False)
    goals: Goals
    point: bytes
    labels: bytes
    level: int


class Keeper:
    """Constraint solver of one model."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._benches: dict[int, Bench] = {}
        self._kept = lru_cache(KEPT)(self._held)
        self._seen = lru_cache(KEPT)(self._places)

    @cached_property
    def measures(self) -> bool:
        """True if a control is measured on the motion."""
        return any(c.measure for c in self._session.card.controls)

    def goals(self, question: Question, asked: MotionQuestion) -> Goals:
        """Return the constraints of a question; raises as `goals.of` does."""
        if not asked.corrects and not self.measures:
            return NOTHING
        return goals.of(self._session.card, question, asked)

    def controls(
        self, question: Question, asked: MotionQuestion, chooser: Chooser
    ) -> dict[str, float] | None:
        """Return all controls of a question with open controls and targets, else None.

        The open controls are the conditional mean, given the other controls and the targets.
        """
        if not (question.inferred and asked.targets):
            return None
        # Validation comes first: the search for controls takes about a second.
        targets = self.goals(question, asked).targets
        open_ = set(question.inferred)
        given = {name: v for name, v in question.controls.items() if name not in open_}
        given |= read_off(self._session.card, given, targets)
        if len(given) == len(question.controls):
            return given
        return self._nearest(question, given, targets, chooser)

    def _nearest(
        self,
        question: Question,
        given: dict[str, float],
        targets: tuple[Goal, ...],
        chooser: Chooser,
    ) -> dict[str, float]:
        """Return the controls with which the model's prediction comes nearest to the targets.

        The conditional mean is linear in the targets, but motions are not, so the remaining error
        is added to the requested positions in each round. It stops when the distance of the targets
        is within the spread of captured motions; a closer fit would attribute chance to the
        controls.
        """
        seen = np.hstack([self._seen(goal.moment, goal.time) for goal in targets])
        wanted = asked = target_values(targets)
        tried: list[tuple[float, dict[str, float]]] = []
        for _ in range(ROUNDS):
            found = chooser.fill_seen(given, question.labels, seen, asked)
            own = replace(question, controls=found, point=np.array([list(found.values())]))
            begun = self.held(own, NOTHING)
            aims = self._targets(own, targets, begun)
            tried.append((self._bench(question.level).distance(begun, aims), found))
            if tried[-1][0] <= math.sqrt(len(wanted)):
                break
            asked = asked + wanted - looking.look(aims, begun.scene, begun.numbers)[0]
        return min(tried, key=lambda pair: pair[0])[1]

    def held(self, question: Question, found: Goals) -> Held:
        """Return the motion that satisfies its constraints, as far as captured motions reach.

        Without constraints, it is the predicted motion. Raises InvalidField for a target at a time
        outside the clip.
        """
        point, labels = question.point.tobytes(), question.labels.tobytes()
        return self._kept(_Asked(question, found, point, labels, question.level))

    def measured(self, question: Question, held: Held) -> dict[str, float]:
        """Return the measured controls of a motion."""
        return self._bench(question.level).measured(held)

    def poses(
        self, question: Question, held: Held, when: Floats, trust: Trust
    ) -> PoseAnswer[np.float64]:
        """Return the poses of a motion at times (S,), s."""
        rotations, roots = held.poses(self._frames(question, held, when))
        return PoseAnswer(when, rotations, roots, held.state.bones, trust)

    def _places(self, moment: Measure, time: float | None) -> Floats:
        """Return a joint's predicted position (n, 3), m, at a moment of each captured clip."""
        goal = Goal("", moment, (0.0, 0.0, 0.0), time)
        found = []
        for state in self._captured if time is None else self._predicted(time):
            cancellation.check()
            begun = self._bench(0).begun(state)
            aim, motion = self._aim(goal, begun, state.frames[0]), begun.scene.motion(begun.numbers)
            # `among` computes the value without its gradient, which is not needed here.
            found.append(aim.among(begun.scene, begun.numbers, motion[None])[0])
        return np.array(found)

    @cached_property
    def _captured(self) -> list[State]:
        """Predictions for the captured clips; moments without a time share them."""
        return self._predicted(0.0)

    def _predicted(self, time: float) -> list[State]:
        """Return the prediction for each captured clip, with the canonical frame of a time, s."""
        card, when = self._session.card, np.array([time])
        pairs = zip(card.examples, card.labels, strict=True)
        return [self._session.state(np.array([own]), when, labels[None]) for own, labels in pairs]

    def _bench(self, level: int) -> Bench:
        if level not in self._benches:
            self._benches[level] = constrained_motion.bench(self._session, level)
        return self._benches[level]

    def _frames(self, question: Question, held: Held, when: Floats) -> Floats:
        """Return the canonical frames (S,) of times (S,), s, scaled by a corrected duration."""
        shares = when * (held.state.duration / held.duration)
        own = self._session.state(question.point, shares, question.labels, question.level)
        return own.frames

    def _held(self, asked: _Asked) -> Held:
        question, bench = asked.question, self._bench(asked.question.level)
        state = self._session.state(question.point, np.zeros(1), question.labels, question.level)
        begun = held = bench.begun(state)
        if not asked.goals:
            return begun
        aims = looking.of_controls(asked.goals.controls, bench.reduced.frames)
        pins = bench.pins(begun) if asked.goals.pin_feet else []
        last = bench.reduced.frames - 1.0
        for _ in range(ROUNDS):
            aimed = self._targets(question, asked.goals.targets, held)
            found = bench.held(begun, [*self._beside(aims, aimed, last), *aimed], pins)
            settled = abs(found.duration / held.duration - 1.0) < SAME
            held = found
            if settled:
                break
        self._check_times(asked.goals.targets, held)
        _refuse_twins(self._targets(question, asked.goals.targets, held), last)
        return held

    def _beside(self, aims: Sequence[Aim], targets: Sequence[Place], last: float) -> list[Aim]:
        """Return the constraints without those of a joint that a target places at the same frame.

        The target is more specific than the control.
        """
        return [
            aim
            for aim in aims
            if not (isinstance(aim, Place) and any(_same(aim, own, last) for own in targets))
        ]

    def _targets(self, question: Question, targets: tuple[Goal, ...], held: Held) -> list[Place]:
        """Return the constraints of targets, at the canonical frames of the given motion."""
        # The duration is known only after the correction; times beyond the longest plausible clip
        # are limited because they may overflow float32.
        longest = input_limits.durations(self._session.card)[1]
        times = np.array([min(goal.time or 0.0, longest) for goal in targets])
        timed = self._frames(question, held, times) if len(times) else times
        pairs = zip(targets, timed.tolist(), strict=True)
        return [self._aim(goal, held, frame) for goal, frame in pairs]

    def _aim(self, goal: Goal, held: Held, frame: float) -> Place:
        """Return the constraint of a target; frame: canonical frame of its time, if it has one."""
        last = held.scene.reduced.frames - 1
        at = (goal.moment.share or 0.0) * last if goal.time is None else frame
        return Place((goal.name,), goal.moment, (0, 1, 2), np.array(goal.place), at)

    def _check_times(self, targets: tuple[Goal, ...], held: Held) -> None:
        for index, goal in enumerate(targets):
            if goal.time is not None:
                field = f"targets/{index}/time"
                value_validation.rounded_within(field, goal.time, 0.0, held.duration, "s")


def _same(a: Place, b: Place, last: float) -> bool:
    """Return whether two constraints are on the same joints at one frame.

    False for moments that the motion determines.
    """
    at, other = a.frame(last), b.frame(last)
    if a.moment.joints != b.moment.joints or at is None or other is None:
        return False
    return abs(at - other) < TWINS


def _refuse_twins(targets: Sequence[Place], last: float) -> None:
    """Raise InvalidField for a second target of a joint at a time that maps to the same frame."""
    for later, aim in enumerate(targets):
        for earlier, other in enumerate(targets[:later]):
            if _same(aim, other, last):
                raise InvalidField(
                    f"targets/{later}",
                    f"{aim.names[0]} has a target already (targets/{earlier}: {other.names[0]}), "
                    "expected one",
                )


def read_off(
    card: ModelCard, given: Mapping[str, float], goals: tuple[Goal, ...]
) -> dict[str, float]:
    """Return values of controls that targets determine, limited to the sampled ranges.

    The targets remain constraints.
    """
    found = {}
    for goal in goals:
        for control in card.controls:
            own = control.measure
            if control.name in given or own is None or own.quantity not in AXES:
                continue
            same = (own.joints, own.at, own.share) == (
                goal.moment.joints,
                goal.moment.at,
                goal.moment.share,
            )
            if same and goal.time is None:
                value = float(goal.place[AXES[own.quantity]])
                # Beyond the sampled range, the correction approaches the target, not the model's
                # extrapolation.
                found[control.name] = min(max(value, control.minimum), control.maximum)
    return found


def target_values(goals: tuple[Goal, ...]) -> Floats:
    """Return the target positions (3 G,) of the goals, concatenated."""
    return np.array([value for goal in goals for value in goal.place])
