"""A model's exact answers: what corrections need, and the last of them."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache

import numpy as np

from service.motion.answer import PoseAnswer, Trust
from service.motion.conventions import Floats
from service.motion.errors import InvalidField
from service.motion.measure import Measure
from service.synthesis import limits
from service.synthesis.door import Question
from service.synthesis.exact import aims as looking
from service.synthesis.exact import goals, holding, inverse
from service.synthesis.exact.aims import Aim, Place
from service.synthesis.exact.goals import NOTHING, Goal, Goals
from service.synthesis.exact.holding import Bench, Held
from service.synthesis.question import HOLD, Hold
from service.synthesis.session import Session, State
from service.synthesis.typical import Chooser

# Somebody who plays a clip pose by pose, or looks at a few.
KEPT = 64
# A speed that is met changes the duration, and so the frame at a time in seconds.
ROUNDS, SAME = 8, 1e-6
# Canonical frames that are one moment.
TWINS = 1e-3


@dataclass(frozen=True)
class _Asked:
    """A question and its goals, told by what they are made of."""

    question: Question = field(compare=False)
    goals: Goals
    point: bytes
    labels: bytes
    level: int


class Keeper:
    """Answers of one model that are held to something."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._benches: dict[int, Bench] = {}
        self._kept = lru_cache(KEPT)(self._held)
        self._seen = lru_cache(KEPT)(self._places)

    @cached_property
    def correctable(self) -> bool:
        """Whether the model's file can be asked for exact answers."""
        return self._session.correctable

    @cached_property
    def measures(self) -> bool:
        """Whether some control is measured on the motion."""
        return self.correctable and any(c.measure for c in self._session.card.controls)

    def goals(self, question: Question, hold: Hold) -> Goals:
        """What a question is held to; raises as `goals.of`."""
        if hold is HOLD and not self.measures:
            return NOTHING
        return goals.of(self._session.card, question, hold, self.correctable)

    def controls(self, question: Question, hold: Hold, chooser: Chooser) -> dict[str, float] | None:
        """All controls of a question that leaves some open and names targets, as is most typical
        for both; None for any other."""
        if not (question.inferred and hold.targets and self.correctable):
            return None
        targets = self.goals(question, Hold("none", hold.targets)).targets
        open_ = set(question.inferred)
        given = {name: v for name, v in question.controls.items() if name not in open_}
        given |= inverse.read_off(self._session.card, given, targets)
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
        """Controls by which the model itself comes near the targets.

        What is typical is linear, and motions are not: what it misses is asked for in addition,
        until the targets lie no farther off than captured motions stray. To ask for less would
        explain by controls what is chance.
        """
        seen = np.hstack([self._seen(goal.moment, goal.time) for goal in targets])
        wanted = asked = inverse.wanted(targets)
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
        """The motion that meets its goals, or comes as near as captured motions get; the predicted
        one where there are none.

        Raises InvalidField for a target at a time that the clip does not have.
        """
        point, labels = question.point.tobytes(), question.labels.tobytes()
        return self._kept(_Asked(question, found, point, labels, question.level))

    def measured(self, question: Question, held: Held) -> dict[str, float]:
        """Measured controls of a motion."""
        return self._bench(question.level).measured(held)

    def poses(
        self, question: Question, held: Held, when: Floats, trust: Trust
    ) -> PoseAnswer[np.float64]:
        """Poses of a motion at times (S,), s."""
        rotations, roots = held.poses(self._frames(question, held, when))
        return PoseAnswer(when, rotations, roots, held.state.bones, trust)

    def _places(self, moment: Measure, time: float | None) -> Floats:
        """Where the model puts a joint (n, 3), m, at a moment of each captured clip."""
        goal = Goal("", moment, (0.0, 0.0, 0.0), time)
        found = []
        for state in self._captured if time is None else self._predicted(time):
            begun = self._bench(0).begun(state)
            aim, motion = self._aim(goal, begun, state.frames[0]), begun.scene.motion(begun.numbers)
            # Its value alone: nobody asks here how that changes.
            found.append(aim.among(begun.scene, begun.numbers, motion[None])[0])
        return np.array(found)

    @cached_property
    def _captured(self) -> list[State]:
        """What the model predicts of each captured clip, whichever moment is looked at."""
        return self._predicted(0.0)

    def _predicted(self, time: float) -> list[State]:
        """What the model predicts of each captured clip, and at which frame it is at a time, s."""
        card, when = self._session.card, np.array([time])
        pairs = zip(card.examples, card.labels, strict=True)
        return [self._session.state(np.array([own]), when, labels[None]) for own, labels in pairs]

    def _bench(self, level: int) -> Bench:
        if level not in self._benches:
            self._benches[level] = holding.bench(self._session, level)
        return self._benches[level]

    def _frames(self, question: Question, held: Held, when: Floats) -> Floats:
        """Canonical frames (S,) at times (S,), s: a corrected duration keeps the clip's pace."""
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
        """Aims of controls but those of a joint that a target places at the same frame: it is the
        nearer word."""
        return [
            aim
            for aim in aims
            if not (isinstance(aim, Place) and any(_same(aim, own, last) for own in targets))
        ]

    def _targets(self, question: Question, targets: tuple[Goal, ...], held: Held) -> list[Place]:
        """Aims of targets; the frames of those at a time are a motion's own."""
        # Whether a time is within the clip shows when it is known how long that is; what is within
        # none might be more than a float32 holds.
        longest = limits.durations(self._session.card)[1]
        times = np.array([min(goal.time or 0.0, longest) for goal in targets])
        timed = self._frames(question, held, times) if len(times) else times
        pairs = zip(targets, timed.tolist(), strict=True)
        return [self._aim(goal, held, frame) for goal, frame in pairs]

    def _aim(self, goal: Goal, held: Held, frame: float) -> Place:
        """Aim of a target, which, where it has a time, counts at that canonical frame."""
        last = held.scene.reduced.frames - 1
        at = (goal.moment.share or 0.0) * last if goal.time is None else frame
        return Place((goal.name,), goal.moment, (0, 1, 2), np.array(goal.place), at)

    def _check_times(self, targets: tuple[Goal, ...], held: Held) -> None:
        for index, goal in enumerate(targets):
            if goal.time is not None:
                limits.within(f"targets/{index}/time", goal.time, 0.0, held.duration, "s")


def _same(a: Place, b: Place, last: float) -> bool:
    """Whether two aims are of the same joints at one frame; moments that have to be looked for are
    at none."""
    at, other = a.frame(last), b.frame(last)
    if a.moment.joints != b.moment.joints or at is None or other is None:
        return False
    return abs(at - other) < TWINS


def _refuse_twins(targets: Sequence[Place], last: float) -> None:
    """InvalidField for a second target of a joint at a time that turns out to be the same."""
    for later, aim in enumerate(targets):
        for earlier, other in enumerate(targets[:later]):
            if _same(aim, other, last):
                raise InvalidField(
                    f"targets/{later}",
                    f"{aim.names[0]} has a target already (targets/{earlier}: {other.names[0]}), "
                    "expected one",
                )
