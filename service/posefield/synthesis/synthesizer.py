"""A named model: validation of its questions, and the trust of its answers."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cached_property

from msgspec import structs

from posefield.common.errors import OutOfReach, OutsideSamples
from posefield.common.units import MICROMETRES
from posefield.constraints import take_variation, targets
from posefield.constraints.constrained_motion import ConstrainedMotion
from posefield.constraints.constraint_solver import ConstraintSolver
from posefield.constraints.targets import ConstraintSet
from posefield.inference.level_selection import NamedModel
from posefield.kriging import random_field
from posefield.locomotion.gait import Gait, fit_gait
from posefield.model_file.model_card import PERFORMER
from posefield.question.motion_question import ExtrapolationPolicy, MotionQuestion, check_take
from posefield.question.results import ConstraintResult, Deviation, Trust, split_results
from posefield.validation import question_validation
from posefield.validation.question_validation import QuestionValidator, ValidatedQuestion

NO_DETAIL = "detail: this model's file has none to sample"


@dataclass(frozen=True)
class Synthesizer(NamedModel):
    """A named model, from which `poses`, `clips` and others compute answers."""

    @cached_property
    def solver(self) -> ConstraintSolver:
        """Constraint solver of this model."""
        return ConstraintSolver(self.session)

    @cached_property
    def gait(self) -> Gait:
        """Gait of this model; raises InvalidField as `fit_gait` does."""
        return fit_gait(self.session)

    @cached_property
    def validator(self) -> QuestionValidator:
        """Validation of questions for one character."""
        return QuestionValidator(self.session.card)

    @cached_property
    def exact_levels(self) -> dict[int, bool]:
        """Cache of `poses.is_batch_exact` by level."""
        return {}

    @cached_property
    def exact_clip_levels(self) -> dict[int, bool]:
        """Cache of `clips.is_exact` by level."""
        return {}

    @cached_property
    def durations(self) -> tuple[float, float]:
        """Shortest and longest plausible duration, s."""
        return question_validation.duration_range(self.session.card)

    def question(self, asked: MotionQuestion) -> ValidatedQuestion:
        """Return the validated question; open controls are conditional means.

        The means are conditional on the given controls and the targets. Raises InvalidField and
        OutsideSamples as the validation does.
        """
        check_take(asked.take, asked.variety)
        if asked.take:
            random_field.check_features(self.session.card.kriging, asked.take)
        policy, who, level = asked.extrapolate, asked.performer, asked.level
        given = self.validator.question(asked.controls, policy, who, level, asked.labels)
        if not (given.inferred and asked.targets):
            return given
        # Validation comes first: the search for controls takes about a second.
        constraints = targets.from_question(self.session.card, given, asked)
        controls = self.solver.controls(given, constraints.targets, self.validator.imputer)
        complete = self.validator.question(controls, policy, who, level, asked.labels)
        return replace(complete, inferred=given.inferred)

    @cached_property
    def measures(self) -> bool:
        """Whether a control is measured on the motion."""
        return any(control.measure for control in self.session.card.controls)

    def constraints(
        self, question: ValidatedQuestion, asked: MotionQuestion
    ) -> ConstraintSet | None:
        """Return the constraints of a question, or None for the prediction.

        Raises as `targets.from_question` does.
        """
        if not (asked.has_constraints or self.measures):
            return None
        return targets.from_question(self.session.card, question, asked) or None

    def solve_constraints(
        self, question: ValidatedQuestion, goals: ConstraintSet, extrapolate: ExtrapolationPolicy
    ) -> ConstrainedMotion:
        """Return the motion that meets its targets.

        Raises OutOfReach for a missed target if `extrapolate` is "refuse".
        """
        held = self.solver.solve(question, goals)
        if extrapolate == "refuse":
            check_targets(goals, held.results)
        return held

    def check_duration(self, duration: float) -> float:
        """Return the duration, s; OutsideSamples if extrapolation makes it implausible."""
        low, high = self.durations
        if not low <= duration <= high:
            raise OutsideSamples(
                "controls", question_validation.implausible_duration(self.session.card, duration)
            )
        return duration

    def trust(
        self, asked: MotionQuestion, question: ValidatedQuestion, duration: float, sigma: float
    ) -> Trust:
        """Return the trust of an answer with this duration, s, and sigma, m."""
        who, apart = question.performer, question.deviations
        warnings = question_validation.merge_warnings(question.warnings, apart, asked.extrapolate)
        if asked.detail and not self.session.card.making.detail:
            warnings = (*warnings, NO_DETAIL)
        named = who is not None or PERFORMER in question.named_labels
        seen = named if self.session.card.performers else None
        shares = self.session.card.joint_sigma if asked.joint_sigma else ()
        varies = asked.take or asked.detail
        take = take_variation.settings(self.session.card, asked) if varies else None
        return Trust(
            self.identity,
            question.controls,
            who,
            question.level,
            duration,
            sigma,
            question.supported,
            warnings,
            seen,
            inferred=question.inferred,
            joint_sigma=tuple(round(share * sigma, MICROMETRES) for share in shares),
            deviations=apart,
            labels=question.named_labels,
            take={} if take is None else asdict(take),
        )

    def constrained_trust(
        self, asked: MotionQuestion, question: ValidatedQuestion, held: ConstrainedMotion
    ) -> Trust:
        """Return the trust of a constrained answer, with the errors of its targets."""
        measured = self.solver.measured(question, held)
        controls, reached = split_results(held.results, len(asked.targets))
        apart = self._deviations(question, measured, controls)
        question = replace(question, deviations=apart)
        own = self.trust(asked, question, held.duration, held.state.asked_sigma)
        said = () if asked.extrapolate == "ok" else miss_warnings(reached)
        warnings = (*own.warnings, *said)
        return structs.replace(own, warnings=warnings, measured=measured, targets=held.results)

    def _deviations(
        self,
        question: ValidatedQuestion,
        measured: Mapping[str, float],
        results: Sequence[ConstraintResult],
    ) -> tuple[Deviation, ...]:
        """Return the deviations of a constrained motion, in the order of the card.

        measured: values of its measured controls. results: those of constrained controls, whose
        deviations are measured.
        """
        reached = {met.what: met.reached for met in results}
        found = {each.control: each for each in question.deviations if each.control not in reached}
        for control in self.session.card.controls:
            name = control.name
            if not reached.get(name, True):
                found[name] = question_validation.deviation(
                    control, question.controls[name], measured[name]
                )
        return tuple(found[name] for name in question.controls if name in found)


def miss_warnings(met: Sequence[ConstraintResult]) -> tuple[str, ...]:
    """Return a sentence for each constraint that is not met."""
    return tuple(_miss_warning(each) for each in met if not each.reached)


def check_targets(goals: ConstraintSet, met: Sequence[ConstraintResult]) -> None:
    """Raise OutOfReach, which names the first, if a constraint is not met."""
    for field, each in zip(_constraint_fields(goals, met), met, strict=True):
        if not each.reached:
            raise OutOfReach(field, "; ".join(miss_warnings(met)))


def _constraint_fields(goals: ConstraintSet, met: Sequence[ConstraintResult]) -> Iterator[str]:
    """Yield the field of each constraint in the question; controls precede targets."""
    controls, reached = split_results(met, len(goals.targets))
    yield from (f"controls/{each.what}" for each in controls)
    yield from (f"targets/{index}" for index in range(len(reached)))


def _miss_warning(met: ConstraintResult) -> str:
    miss = f"{100.0 * met.miss:.1f} cm" if met.unit == "m" else f"{met.miss:.3g} {met.unit}"
    return f"{met.what} stays {miss} from its target: out of reach"
