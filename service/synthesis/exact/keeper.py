"""A model's exact answers: what corrections need, and the last of them."""

from dataclasses import dataclass, field
from functools import cached_property, lru_cache

import numpy as np

from service.motion.answer import PoseAnswer, Trust
from service.motion.conventions import Floats
from service.synthesis import limits
from service.synthesis.door import Question
from service.synthesis.exact import aims as looking
from service.synthesis.exact import goals, holding
from service.synthesis.exact.aims import Aim, Place
from service.synthesis.exact.goals import NOTHING, Goal, Goals
from service.synthesis.exact.holding import Bench, Held
from service.synthesis.question import HOLD, Hold
from service.synthesis.session import Session

# Somebody who plays a clip pose by pose, or looks at a few.
KEPT = 64
# A speed that is met changes the duration, and so the frame at a time in seconds.
ROUNDS, SAME = 8, 1e-6


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
        for _ in range(ROUNDS):
            aimed = self._targets(question, asked.goals.targets, held)
            found = bench.held(begun, [*aims, *aimed], pins)
            settled = abs(found.duration / held.duration - 1.0) < SAME
            held = found
            if settled:
                break
        self._check_times(asked.goals.targets, held)
        return held

    def _targets(self, question: Question, targets: tuple[Goal, ...], held: Held) -> list[Aim]:
        """Aims of targets; the frames of those at a time are a motion's own."""
        times = np.array([goal.time or 0.0 for goal in targets])
        timed = self._frames(question, held, times) if len(times) else times
        last = held.scene.reduced.frames - 1
        frames = [
            (goal.moment.share or 0.0) * last if goal.time is None else frame
            for goal, frame in zip(targets, timed, strict=True)
        ]
        return [
            Place((goal.name,), goal.moment, (0, 1, 2), np.array(goal.place), float(frame))
            for goal, frame in zip(targets, frames, strict=True)
        ]

    def _check_times(self, targets: tuple[Goal, ...], held: Held) -> None:
        for index, goal in enumerate(targets):
            if goal.time is not None:
                limits.within(f"targets/{index}/time", goal.time, 0.0, held.duration, "s")
