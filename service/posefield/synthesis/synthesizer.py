"""A named model: validation of its questions, and the trust of its answers."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from posefield.common.errors import OutOfReach, OutsideSamples
from posefield.constraints.constrained_motion import Held
from posefield.constraints.constraint_solver import Keeper
from posefield.constraints.targets import Goals
from posefield.inference.named_model import NamedModel
from posefield.question.motion_question import MotionQuestion, Policy
from posefield.question.results import Met, Trust
from posefield.validation import input_limits
from posefield.validation.question_validation import Door, Question

MICROMETRES = 6
"""Decimals of a length in metres."""


@dataclass(frozen=True)
class Synthesizer(NamedModel):
    """A named model, from which `poses`, `clips` and others compute answers."""

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
        return input_limits.durations(self.session.card)

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
            refuse(goals, held.met)
        return held

    def sensible(self, duration: float) -> float:
        """Return the duration, s; OutsideSamples if extrapolation makes it implausible."""
        low, high = self.durations
        if not low <= duration <= high:
            raise OutsideSamples("controls", input_limits.senseless(self.session.card, duration))
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
        said = () if asked.extrapolate == "ok" else sentences(held.met)
        warnings = (*own.warnings, *said)
        return replace(own, warnings=warnings, measured=measured, targets=held.met)


def sentences(met: Sequence[Met]) -> tuple[str, ...]:
    """Return a sentence for each constraint that is not met."""
    return tuple(_sentence(each) for each in met if not each.reached)


def refuse(goals: Goals, met: Sequence[Met]) -> None:
    """Raise OutOfReach, which names the first, if a constraint is not met."""
    for field, each in zip(_fields(goals, met), met, strict=True):
        if not each.reached:
            raise OutOfReach(field, "; ".join(sentences(met)))


def _fields(goals: Goals, met: Sequence[Met]) -> Iterator[str]:
    """Yield the field of each constraint in the question; controls precede targets."""
    first = len(met) - len(goals.targets)
    for index, each in enumerate(met):
        yield f"controls/{each.what}" if index < first else f"targets/{index - first}"


def _sentence(met: Met) -> str:
    miss = f"{100.0 * met.miss:.1f} cm" if met.unit == "m" else f"{met.miss:.3g} {met.unit}"
    return f"{met.what} stays {miss} from its target: out of reach"
