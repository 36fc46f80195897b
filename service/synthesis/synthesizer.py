"""Questions to a model, checked at the door, and its answers in the project's own types."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from service.motion import roles
from service.motion.answer import ClipAnswer, PoseAnswer, Trust
from service.motion.clip import assemble
from service.motion.conventions import Floats
from service.motion.errors import InvalidField, OutsideSamples
from service.motion.roles import Names
from service.motion.skeleton import Skeleton
from service.synthesis import course, door, limits, pace
from service.synthesis.question import ClipQuestion, Policy, Prospect
from service.synthesis.session import Session
from service.synthesis.view import Ladder
from service.synthesis.walk import stride

ANSWERED = ("rotations", "root_position", "bone_offsets", "duration", "sigma")


@dataclass(frozen=True)
class _Question:
    """What has passed the door: controls, in the card's order, and performer as they were given,
    and as the graph takes them, point (1, d) and labels (1, p); a warning for each control outside
    its sampled range."""

    controls: dict[str, float]
    performer: str | None
    level: int
    point: Floats
    labels: Floats
    warnings: tuple[str, ...]


@dataclass(frozen=True)
class Synthesizer:
    """A named model that answers with poses and clips."""

    name: str
    session: Session

    @property
    def identity(self) -> str:
        """name@contenthash: what an answer under this name will always be."""
        return f"{self.name}@{self.session.digest}"

    @cached_property
    def ladder(self) -> Ladder:
        """What each level of detail errs and costs, for a view to choose by.

        An error is that of the worst pose: nobody's exceeds it, as far as was asked. Costs are
        measured when first wanted.
        """
        errors = np.array([level.pose for level in self.session.card.levels])
        return Ladder(errors, np.array(pace.seconds_per_pose(self.session)))

    @property
    def middle(self) -> Floats:
        """Where the root is at rest (3,), m."""
        return self.session.card.skeleton.offsets[0]

    @cached_property
    def radius(self) -> float:
        """Of a sphere about the root that holds the body at rest, m."""
        joints = self.session.card.skeleton
        rest = joints.at_rest(joints.offsets)
        return float(np.linalg.norm(rest - rest[0], axis=-1).max())

    @cached_property
    def _skeletons(self) -> dict[Names, Skeleton]:
        """The skeletons that were asked for, each made once."""
        return {"own": self.session.card.skeleton}

    def _joints(self, asked: ClipQuestion) -> Skeleton:
        """The skeleton with the names asked for; InvalidField for names that no role leads to, and
        for a loop of what is no cycle."""
        card = self.session.card
        if asked.loop and not card.cyclic:
            raise InvalidField(
                "loop", "true, expected false: this model's last pose does not lead into its first"
            )
        if asked.names not in self._skeletons:
            self._skeletons[asked.names] = roles.renamed(card.skeleton, card.roles, asked.names)
        return self._skeletons[asked.names]

    def pose(
        self,
        controls: Mapping[str, float],
        times: Sequence[float],
        extrapolate: Policy,
        performer: str | None = None,
        level: int = 0,
    ) -> PoseAnswer:
        """Poses at times (S,), s from the start of the clip, as a performer of the card moves, or
        somebody who was never seen, at a level of detail.

        Raises InvalidField for a control, time, performer or level that cannot be used,
        OutsideSamples where `extrapolate` is "refuse" and a control lies outside its sampled range.
        """
        question = self._door(controls, extrapolate, performer, level)
        if not 1 <= len(times) <= course.MOST_POSES:
            raise InvalidField("times", f"{len(times)} times, expected 1 to {course.MOST_POSES}")
        when = np.array([limits.number(f"times/{i}", value) for i, value in enumerate(times)])
        duration = self._duration(question)
        for index, value in enumerate(when):
            limits.within(f"times/{index}", value, 0.0, duration, "s")
        return self._answer(question, when)

    def clip(self, asked: ClipQuestion) -> ClipAnswer:
        """Clip of the question; frame i is the pose at start + i / fps.

        The N steps of a loop share the duration evenly, but are played at fps. Raises as `pose`
        does, and InvalidField for a loop of what is no cycle and names that no role leads to.
        """
        question = self._door(asked.controls, asked.extrapolate, asked.performer, asked.level)
        joints = self._joints(asked)
        answer = self._answer(question, course.times(asked, self._duration(question)))
        if asked.loop or asked.root == "in_place":
            answer = self._routed(question, answer, asked)
        turns, path, offsets = answer.rotations, answer.root_position, answer.bone_offsets
        return ClipAnswer(assemble(joints, turns, path, offsets, float(asked.fps)), answer.trust)

    def check(self, asked: ClipQuestion) -> None:
        """Raise what `clip` would, as far as it can be said before anything is synthesised: how
        long the clip takes is not known yet."""
        self._door(asked.controls, asked.extrapolate, asked.performer, asked.level)
        self._joints(asked)
        course.window(asked, limits.durations(self.session.card)[1])

    def prospect(self, asked: ClipQuestion) -> Prospect:
        """What `clip` would answer with, before it is synthesised.

        Asked for one by one, as there: how long clips take differs in the last digit where many are
        asked for at once, and a question whose end is the clip's own would pass here and be refused
        later. Raises as `clip` does.
        """
        question = self._door(asked.controls, asked.extrapolate, asked.performer, asked.level)
        self._joints(asked)
        times = course.times(asked, self._duration(question))
        # A loop ends with its first frame again.
        return Prospect(len(times) + asked.loop, question.warnings)

    def _door(
        self, controls: Mapping[str, float], extrapolate: Policy, performer: str | None, level: int
    ) -> _Question:
        card = self.session.card
        limits.check_names(card, controls)
        labels, coarsest = door.labels(card.performers, performer), len(card.levels) - 1
        if not 0 <= level <= coarsest:
            raise InvalidField("level", f"{level}, expected 0 to {coarsest}")
        point = np.array([[door.required(control, controls) for control in card.controls]])
        said = door.outside(card.controls, point[0], extrapolate)
        # However they are put: the same question has the same bytes.
        given = {control.name: float(controls[control.name]) for control in card.controls}
        return _Question(given, performer, level, point, labels, said)

    def _duration(self, question: _Question) -> float:
        """Seconds that the clip takes; OutsideSamples where extrapolation has lost all sense."""
        durations = self.session.durations(question.point, question.labels, question.level)
        duration = float(durations[0])
        low, high = limits.durations(self.session.card)
        if not low <= duration <= high:
            raise OutsideSamples("controls", limits.senseless(self.session.card, duration))
        return duration

    def _routed(self, question: _Question, answer: PoseAnswer, asked: ClipQuestion) -> PoseAnswer:
        """The answer in place, or closed, as asked for."""
        card = self.session.card
        measure = stride.strides if card.cyclic else stride.straight
        way = measure(self.session, question.point, question.labels, question.level)
        stays = asked.root == "in_place" and card.root == "travelling"
        answer = course.in_place(answer, way) if stays else answer
        return course.closed(answer, None if stays else way) if asked.loop else answer

    def _answer(self, question: _Question, when: Floats) -> PoseAnswer:
        answers = self._run(question, when[None], *ANSWERED)
        rotations, root, offsets, duration, sigma = (a[0].astype(np.float64) for a in answers)
        trust = Trust(
            self.identity,
            question.controls,
            float(duration),
            float(sigma),
            question.warnings,
            question.performer,
            question.level,
        )
        return PoseAnswer(when, rotations, root, offsets, trust)

    def _run(self, question: _Question, when: Floats, *outputs: str) -> list[Any]:
        labels, level = question.labels, question.level
        return self.session.run(question.point, when, *outputs, labels=labels, level=level)
