"""Questions to a model, checked at the door, and its answers in the project's own types."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from hashlib import blake2b
from typing import Any

import numpy as np

from service.motion import roles
from service.motion.answer import ClipAnswer, PoseAnswer, Trust
from service.motion.clip import assemble
from service.motion.conventions import Floats, Singles
from service.motion.errors import InvalidField, OutsideSamples
from service.motion.roles import Names
from service.motion.skeleton import Skeleton
from service.synthesis import course, limits, pace
from service.synthesis.door import Door, Question
from service.synthesis.exact import missed, rounding, strides
from service.synthesis.exact.goals import NOTHING, Goals
from service.synthesis.exact.holding import Held
from service.synthesis.exact.keeper import Keeper
from service.synthesis.question import HOLD, ClipQuestion, Hold, Policy, Prospect
from service.synthesis.session import Session
from service.synthesis.view import Ladder
from service.synthesis.walk import stride
from service.synthesis.walk.stride import Strides

ANSWERED = ("rotations", "root_position", "bone_offsets", "duration", "sigma")


@dataclass(frozen=True)
class Moments:
    """A question for poses that has passed the door, its times (S,), s, as they were given and as
    the graph is asked, and the earliest and the latest of them."""

    question: Question
    when: Floats
    asked: Floats
    first: float
    last: float

    @property
    def level(self) -> int:
        """Level of detail."""
        return self.question.level


OLD = "does not say how far its joints err; train it again"
MICROMETRES = 6
"""Decimals of a metre."""
SAMPLE = 17
"""Questions that show whether answers depend on others: odd, and more than rows of a kernel."""

Row = tuple[Singles, ...]
"""ANSWERED of one question: (S, J, 4), (S, 3), (J, 3), and two numbers."""


@dataclass(frozen=True)
class Synthesizer:
    """A named model that answers with poses and clips."""

    name: str
    session: Session

    @cached_property
    def identity(self) -> str:
        """name@contenthash: what an answer under this name will always be."""
        return f"{self.name}@{self.session.digest}"

    @cached_property
    def fingerprint(self) -> bytes:
        """Digest of the model's file and of what it answers here: machines that round otherwise
        differ in it."""
        parts = self.identity.encode() + self.session.golden + rounding.mark()
        return blake2b(parts, digest_size=16).digest()

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
        """The skeleton with the names asked for; InvalidField for names that no role leads to, for
        a loop of what is no cycle, and for sigma by joint of a model that cannot say."""
        card = self.session.card
        if asked.joint_sigma:
            self._shares()
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
        hold: Hold = HOLD,
    ) -> PoseAnswer[Any]:
        """Poses at times (S,), s from the start of the clip, as a performer of the card moves, or
        somebody who was never seen, at a level of detail, of a motion that is held to something.

        Raises InvalidField for a control, time, performer or level that cannot be used, or for what
        the motion cannot be held to; where `extrapolate` is "refuse", OutsideSamples where nothing
        like the controls was captured and OutOfReach for a goal that is missed.
        """
        asked = self.moments(controls, times, extrapolate, performer, level, hold)
        goals = self.keeper.goals(asked.question, hold)
        if goals:
            return self.held_poses(asked, goals, extrapolate)
        return self.posed(asked, self.poses([asked])[0])

    def held_poses(
        self, asked: Moments, goals: Goals, extrapolate: Policy
    ) -> PoseAnswer[np.float64]:
        """Poses of a motion that is held to something; raises as `pose`."""
        question = asked.question
        held = self._meeting(question, goals, extrapolate)
        self._check_times(asked, self._sensible(held.duration))
        trust = self._held_trust(question, held, extrapolate)
        return self.keeper.poses(question, held, asked.when, trust)

    def moments(
        self,
        controls: Mapping[str, float],
        times: Sequence[float],
        extrapolate: Policy,
        performer: str | None = None,
        level: int = 0,
        hold: Hold = HOLD,
    ) -> Moments:
        """The question of `pose` as far as it can be checked before the model is asked."""
        question = self.question(controls, extrapolate, performer, level, hold)
        if not 1 <= len(times) <= course.MOST_POSES:
            raise InvalidField("times", f"{len(times)} times, expected 1 to {course.MOST_POSES}")
        when = [limits.number(f"times/{i}", value) for i, value in enumerate(times)]
        # Whether a time is within the clip shows when the graph has said how long that is; what is
        # within none of them might be more than a float32 holds.
        longest = self._durations[1]
        first, last, given = min(when), max(when), np.array(when)
        fits = 0.0 <= first and last <= longest
        asked = given if fits else np.clip(given, 0.0, longest)
        return Moments(question, given, asked, first, last)

    def poses(self, asked: Sequence[Moments]) -> list[Row]:
        """What the graph says to questions of as many times and of one level, in one call.

        Where `exact`, a question gets the same bytes whatever it is asked with.
        """
        first = asked[0].question
        if len(asked) == 1 and len(asked[0].when) == 1:
            # A product with one row is summed in another order: nobody is asked for alone.
            arrays = (first.point, first.labels, asked[0].asked[None])
            points, labels, when = (array.repeat(2, axis=0) for array in arrays)
        else:
            points = np.concatenate([each.question.point for each in asked])
            labels = np.concatenate([each.question.labels for each in asked])
            when = np.array([each.asked for each in asked])
        answers = self.session.run(points, when, *ANSWERED, labels=labels, level=first.level)
        return [tuple(answer[row] for answer in answers) for row in range(len(asked))]

    def exact(self, level: int) -> bool:
        """Whether `poses` gives each of many questions the bytes that it gets alone, as a sample of
        questions says; files of old versions sum by where a question stands among others."""
        if level not in self._exact:
            asked = [self._sample(share, level) for share in np.linspace(0.0, 1.0, SAMPLE)]
            alone = (self.poses([each])[0] for each in asked)
            both = zip(self.poses(asked), alone, strict=True)
            self._exact[level] = all(
                np.array_equal(a, b) for row, own in both for a, b in zip(row, own, strict=True)
            )
        return self._exact[level]

    @cached_property
    def keeper(self) -> Keeper:
        """What answers that are held to something come from."""
        return Keeper(self.session)

    @cached_property
    def door(self) -> Door:
        """What questions about one character must pass."""
        return Door(self.session.card)

    @cached_property
    def _durations(self) -> tuple[float, float]:
        return limits.durations(self.session.card)

    @cached_property
    def _exact(self) -> dict[int, bool]:
        return {}

    def _sample(self, share: float, level: int) -> Moments:
        """A question at a share of each control's range, and of the shortest clip."""
        card = self.session.card
        controls = {c.name: c.minimum + share * (c.maximum - c.minimum) for c in card.controls}
        return self.moments(controls, [share * card.durations[0]], "ok", None, level)

    def posed(self, asked: Moments, row: Row) -> PoseAnswer[np.float32]:
        """The answer that a row of `poses` is; raises as `pose` for a time outside the clip."""
        rotations, root, offsets, length, sigma = row
        duration = self._sensible(float(length))
        self._check_times(asked, duration)
        trust = self._trust(asked.question, duration, float(sigma))
        return PoseAnswer(asked.when, rotations, root, offsets, trust)

    def _check_times(self, asked: Moments, duration: float) -> None:
        if not (asked.first >= 0.0 and asked.last <= duration):
            for index, value in enumerate(asked.when):
                limits.within(f"times/{index}", value, 0.0, duration, "s")

    def clip(self, asked: ClipQuestion, most: int = course.MOST_POSES) -> ClipAnswer:
        """Clip of the question, of at most so many frames; frame i is the pose at start + i / fps.

        The N steps of a loop share the duration evenly, but are played at fps. Raises as `pose`
        does, and InvalidField for a loop of what is no cycle and names that no role leads to.
        """
        question = self._asked(asked)
        joints = self._joints(asked)
        goals = self.keeper.goals(question, asked.hold)
        if goals:
            answer = self._held(question, goals, asked, most)
        else:
            answer = self._plain(question, asked, most)
        turns, path, offsets = answer.rotations, answer.root_position, answer.bone_offsets
        trust = self.by_joint(answer.trust) if asked.joint_sigma else answer.trust
        return ClipAnswer(assemble(joints, turns, path, offsets, float(asked.fps)), trust)

    def by_joint(self, trust: Trust) -> Trust:
        """The same with sigma of each joint; InvalidField for a model that cannot say."""
        joints = (round(share * trust.sigma, MICROMETRES) for share in self._shares())
        return replace(trust, joint_sigma=tuple(joints))

    def _shares(self) -> tuple[float, ...]:
        """Sigma of each joint as a share of sigma."""
        found = self.session.card.joint_sigma
        if not found:
            raise InvalidField("joint_sigma", f"true, but {self.identity} {OLD}")
        return found

    def _plain(self, question: Question, asked: ClipQuestion, most: int) -> PoseAnswer[np.float64]:
        """Frames of a clip that is held to nothing."""
        when = course.times(asked, self._duration(question), most)
        answer = self._answer(question, when)
        if self.keeper.measures:
            predicted = self.keeper.held(question, NOTHING)
            measured = self.keeper.measured(question, predicted)
            answer = replace(answer, trust=replace(answer.trust, measured=measured))
        if asked.loop or asked.root == "in_place":
            card = self.session.card
            measure = stride.strides if card.cyclic else stride.straight
            way = measure(self.session, question.point, question.labels, question.level)
            answer = self._routed(answer, way, asked)
        return answer

    def _held(
        self, question: Question, goals: Goals, asked: ClipQuestion, most: int
    ) -> PoseAnswer[np.float64]:
        """Frames of a clip that is held to something."""
        held = self._meeting(question, goals, asked.extrapolate)
        when = course.times(asked, self._sensible(held.duration), most)
        trust = self._held_trust(question, held, asked.extrapolate)
        answer = self.keeper.poses(question, held, when, trust)
        routed = asked.loop or asked.root == "in_place"
        return self._routed(answer, strides.of(held), asked) if routed else answer

    def check(self, asked: ClipQuestion) -> None:
        """Raise what `clip` would, as far as it can be said before anything is synthesised: how
        long the clip takes is not known yet."""
        self.keeper.goals(self._asked(asked), asked.hold)
        self._joints(asked)
        course.window(asked, limits.durations(self.session.card)[1])

    def prospect(self, asked: ClipQuestion) -> Prospect:
        """What `clip` would answer with, before it is synthesised.

        Asked for one by one, as there: how long clips take differs in the last digit where many are
        asked for at once, and a question whose end is the clip's own would pass here and be refused
        later. Raises as `clip` does.
        """
        question = self._asked(asked)
        self._joints(asked)
        duration, misses = self._outlook(question, asked)
        times = course.times(asked, duration)
        # A loop ends with its first frame again.
        return Prospect(len(times) + asked.loop, question.warnings, misses)

    def _asked(self, asked: ClipQuestion) -> Question:
        who, level, policy = asked.performer, asked.level, asked.extrapolate
        return self.question(asked.controls, policy, who, level, asked.hold)

    def question(
        self,
        controls: Mapping[str, float],
        extrapolate: Policy,
        performer: str | None,
        level: int,
        hold: Hold,
    ) -> Question:
        """The question, its open controls as is most typical for those given and for its targets;
        raises as the door does."""
        asked = self.door.question(controls, extrapolate, performer, level)
        found = self.keeper.controls(asked, hold, self.door.chooser)
        if found is None:
            return asked
        every = self.door.question(found, extrapolate, performer, level)
        return replace(every, inferred=asked.inferred)

    def _outlook(self, question: Question, asked: ClipQuestion) -> tuple[float, bool]:
        """Seconds that a clip takes, which a speed that it is held to changes, and whether it
        misses some target."""
        goals = self.keeper.goals(question, asked.hold)
        strict = asked.extrapolate == "refuse" or self.session.card.cyclic
        if not (goals.targets or (goals and strict)):
            return self._duration(question), False
        held = self._meeting(question, goals, asked.extrapolate)
        targets = held.met[len(held.met) - len(goals.targets) :]
        misses = asked.extrapolate != "ok" and not all(met.reached for met in targets)
        return self._sensible(held.duration), misses

    def _meeting(self, question: Question, goals: Goals, extrapolate: Policy) -> Held:
        """The motion that meets its goals; OutOfReach where it does not and that is refused."""
        held = self.keeper.held(question, goals)
        if extrapolate == "refuse":
            missed.refuse(goals, held.met)
        return held

    def _duration(self, question: Question) -> float:
        """Seconds that the clip takes; OutsideSamples where extrapolation has lost all sense."""
        durations = self.session.durations(question.point, question.labels, question.level)
        return self._sensible(float(durations[0]))

    def _sensible(self, duration: float) -> float:
        low, high = self._durations
        if not low <= duration <= high:
            raise OutsideSamples("controls", limits.senseless(self.session.card, duration))
        return duration

    def _routed(
        self, answer: PoseAnswer[np.float64], way: Strides, asked: ClipQuestion
    ) -> PoseAnswer[np.float64]:
        """The answer in place, or closed, as asked for."""
        stays = asked.root == "in_place" and self.session.card.root == "travelling"
        answer = course.in_place(answer, way) if stays else answer
        return course.closed(answer, None if stays else way) if asked.loop else answer

    def _answer(self, question: Question, when: Floats) -> PoseAnswer[np.float64]:
        answers = self._run(question, when[None], *ANSWERED)
        rotations, root, offsets, duration, sigma = (a[0].astype(np.float64) for a in answers)
        trust = self._trust(question, float(duration), float(sigma))
        return PoseAnswer(when, rotations, root, offsets, trust)

    def _trust(self, question: Question, duration: float, sigma: float) -> Trust:
        who = question.performer
        seen = who is not None if self.session.card.performers else None
        return Trust(
            self.identity,
            question.controls,
            duration,
            sigma,
            question.warnings,
            who,
            question.level,
            question.supported,
            seen,
            inferred=question.inferred,
        )

    def _held_trust(self, question: Question, held: Held, extrapolate: Policy) -> Trust:
        own = self._trust(question, held.duration, held.state.sigma)
        measured = self.keeper.measured(question, held)
        said = () if extrapolate == "ok" else missed.sentences(held.met)
        warnings = (*own.warnings, *said)
        return replace(own, warnings=warnings, measured=measured, targets=held.met)

    def _run(self, question: Question, when: Floats, *outputs: str) -> list[Any]:
        labels, level = question.labels, question.level
        return self.session.run(question.point, when, *outputs, labels=labels, level=level)
