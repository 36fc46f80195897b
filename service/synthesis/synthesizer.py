"""A model under its name: what it takes of a question, and what it says of an answer."""

from dataclasses import dataclass, replace
from functools import cached_property
from hashlib import blake2b

import numpy as np

from service.motion import roles
from service.motion.answer import Trust
from service.motion.conventions import Floats
from service.motion.errors import InvalidField, OutsideSamples
from service.motion.roles import Names
from service.motion.skeleton import Skeleton
from service.synthesis import limits, pace
from service.synthesis.door import Door, Question
from service.synthesis.exact import missed, rounding
from service.synthesis.exact.goals import Goals
from service.synthesis.exact.holding import Held
from service.synthesis.exact.keeper import Keeper
from service.synthesis.question import MotionQuestion, Policy
from service.synthesis.session import Session
from service.synthesis.view import Ladder

OLD = "does not say how far its joints err; train it again"
MICROMETRES = 6
"""Decimals of a metre."""


@dataclass(frozen=True)
class Synthesizer:
    """A named model: `poses`, `clips` and others answer with it."""

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

    def skeleton(self, names: Names) -> Skeleton:
        """The skeleton with these names; InvalidField for names that no role leads to."""
        card = self.session.card
        if names not in self._skeletons:
            self._skeletons[names] = roles.renamed(card.skeleton, card.roles, names)
        return self._skeletons[names]

    @cached_property
    def keeper(self) -> Keeper:
        """What answers that are held to something come from."""
        return Keeper(self.session)

    @cached_property
    def door(self) -> Door:
        """What questions about one character must pass."""
        return Door(self.session.card)

    @cached_property
    def exact_levels(self) -> dict[int, bool]:
        """What `poses.exact` has found out so far."""
        return {}

    @cached_property
    def durations(self) -> tuple[float, float]:
        """The shortest and the longest clip that makes sense, s."""
        return limits.durations(self.session.card)

    def question(self, asked: MotionQuestion) -> Question:
        """The question, its open controls as is most typical for those given and for its targets;
        raises as the door does."""
        policy, who, level = asked.extrapolate, asked.performer, asked.level
        given = self.door.question(asked.controls, policy, who, level)
        found = self.keeper.controls(given, asked.hold, self.door.chooser)
        if found is None:
            return given
        every = self.door.question(found, policy, who, level)
        return replace(every, inferred=given.inferred)

    def meeting(self, question: Question, goals: Goals, extrapolate: Policy) -> Held:
        """The motion that meets its goals; OutOfReach where it does not and that is refused."""
        held = self.keeper.held(question, goals)
        if extrapolate == "refuse":
            missed.refuse(goals, held.met)
        return held

    def sensible(self, duration: float) -> float:
        """The same duration, s; OutsideSamples where extrapolation has lost all sense."""
        low, high = self.durations
        if not low <= duration <= high:
            raise OutsideSamples("controls", limits.senseless(self.session.card, duration))
        return duration

    def shares(self) -> tuple[float, ...]:
        """Sigma of each joint as a share of sigma; InvalidField for a model that cannot say."""
        found = self.session.card.joint_sigma
        if not found:
            raise InvalidField("joint_sigma", f"true, but {self.identity} {OLD}")
        return found

    def trust(
        self, asked: MotionQuestion, question: Question, duration: float, sigma: float
    ) -> Trust:
        """What an answer is worth that lasts so long, s, and errs so far, m; InvalidField for sigma
        by joint of a model that cannot say."""
        who = question.performer
        seen = who is not None if self.session.card.performers else None
        shares = self.shares() if asked.joint_sigma else ()
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
            joint_sigma=tuple(round(share * sigma, MICROMETRES) for share in shares),
        )

    def held_trust(self, asked: MotionQuestion, question: Question, held: Held) -> Trust:
        """What an answer that was held to something is worth, and what it misses; raises as
        `trust`."""
        own = self.trust(asked, question, held.duration, held.state.sigma)
        measured = self.keeper.measured(question, held)
        said = () if asked.extrapolate == "ok" else missed.sentences(held.met)
        warnings = (*own.warnings, *said)
        return replace(own, warnings=warnings, measured=measured, targets=held.met)
