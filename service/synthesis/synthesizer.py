"""A named model: validation of its questions, and the trust of its answers."""

from dataclasses import dataclass, replace
from functools import cached_property
from hashlib import blake2b

import numpy as np

from service.motion import roles
from service.motion.answer import Trust
from service.motion.conventions import Floats
from service.motion.errors import OutsideSamples
from service.motion.roles import Names
from service.motion.skeleton import Skeleton
from service.question.motion_question import MotionQuestion, Policy
from service.synthesis import limits, pace
from service.synthesis.door import Door, Question
from service.synthesis.exact import missed, rounding
from service.synthesis.exact.goals import Goals
from service.synthesis.exact.holding import Held
from service.synthesis.exact.keeper import Keeper
from service.synthesis.session import Session
from service.synthesis.view import Ladder

MICROMETRES = 6
"""Decimals of a length in metres."""


@dataclass(frozen=True)
class Synthesizer:
    """A named model, from which `poses`, `clips` and others compute answers."""

    name: str
    session: Session

    @cached_property
    def identity(self) -> str:
        """name@contenthash; answers under this name never change."""
        return f"{self.name}@{self.session.digest}"

    @cached_property
    def fingerprint(self) -> bytes:
        """Digest of the model file and of this machine's rounding.

        It differs between machines on which the model's answers or the correction differ in the
        last digits.
        """
        parts = self.identity.encode() + self.session.golden + rounding.mark()
        return blake2b(parts, digest_size=16).digest()

    @cached_property
    def ladder(self) -> Ladder:
        """Errors and costs of the levels of detail, from which a view chooses.

        An error is that of the worst measured pose. Costs are measured on first use.
        """
        errors = np.array([level.pose for level in self.session.card.levels])
        return Ladder(errors, np.array(pace.seconds_per_pose(self.session)))

    @property
    def middle(self) -> Floats:
        """Root position at rest (3,), m."""
        return self.session.card.skeleton.offsets[0]

    @cached_property
    def radius(self) -> float:
        """Radius, m, of a sphere about the root that contains the body at rest."""
        joints = self.session.card.skeleton
        rest = joints.at_rest(joints.offsets)
        return float(np.linalg.norm(rest - rest[0], axis=-1).max())

    @cached_property
    def _skeletons(self) -> dict[Names, Skeleton]:
        """Cache of skeletons by naming convention."""
        return {"own": self.session.card.skeleton}

    def skeleton(self, names: Names) -> Skeleton:
        """Return the skeleton with these names; InvalidField if the model has no roles for them."""
        card = self.session.card
        if names not in self._skeletons:
            self._skeletons[names] = roles.renamed(card.skeleton, card.roles, names)
        return self._skeletons[names]

    @cached_property
    def keeper(self) -> Keeper:
        """Constraint solver of this model."""
        return Keeper(self.session)

    @cached_property
    def door(self) -> Door:
        """Validation of questions for one character."""
        return Door(self.session.card)

    @cached_property
    def exact_levels(self) -> dict[int, bool]:
        """Cache of `poses.exact` by level."""
        return {}

    @cached_property
    def durations(self) -> tuple[float, float]:
        """Shortest and longest plausible duration, s."""
        return limits.durations(self.session.card)

    def question(self, asked: MotionQuestion) -> Question:
        """Return the validated question; open controls are conditional means.

        The means are conditional on the given controls and the targets. Raises InvalidField and
        OutsideSamples as the validation does.
        """
        policy, who, level = asked.extrapolate, asked.performer, asked.level
        given = self.door.question(asked.controls, policy, who, level)
        found = self.keeper.controls(given, asked, self.door.chooser)
        if found is None:
            return given
        every = self.door.question(found, policy, who, level)
        return replace(every, inferred=given.inferred)

    def meeting(self, question: Question, goals: Goals, extrapolate: Policy) -> Held:
        """Return the motion that meets its targets.

        Raises OutOfReach for a missed target if `extrapolate` is "refuse".
        """
        held = self.keeper.held(question, goals)
        if extrapolate == "refuse":
            missed.refuse(goals, held.met)
        return held

    def sensible(self, duration: float) -> float:
        """Return the duration, s; OutsideSamples if extrapolation makes it implausible."""
        low, high = self.durations
        if not low <= duration <= high:
            raise OutsideSamples("controls", limits.senseless(self.session.card, duration))
        return duration

    def trust(
        self, asked: MotionQuestion, question: Question, duration: float, sigma: float
    ) -> Trust:
        """Return the trust of an answer with this duration, s, and sigma, m."""
        who = question.performer
        seen = who is not None if self.session.card.performers else None
        shares = self.session.card.joint_sigma if asked.joint_sigma else ()
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
        """Return the trust of a constrained answer, with the errors of its targets."""
        own = self.trust(asked, question, held.duration, held.state.sigma)
        measured = self.keeper.measured(question, held)
        said = () if asked.extrapolate == "ok" else missed.sentences(held.met)
        warnings = (*own.warnings, *said)
        return replace(own, warnings=warnings, measured=measured, targets=held.met)
