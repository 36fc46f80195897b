"""A named model: validation of its questions, and the trust of its answers."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cached_property

import numpy as np
from msgspec import structs

from posefield.common.errors import OutOfReach, OutsideSamples
from posefield.common.units import MICROMETRES
from posefield.constraints import constraint, take_variation, targets
from posefield.constraints.constrained_motion import ConstrainedMotion
from posefield.constraints.constraint_solver import ConstraintSolver
from posefield.constraints.targets import ConstraintSet
from posefield.inference.level_selection import NamedModel
from posefield.kriging import random_field
from posefield.locomotion.gait import Gait, fit_gait
from posefield.model_file.model_card import PERFORMER
from posefield.question.motion_question import ExtrapolationPolicy, MotionQuestion, check_take
from posefield.question.results import ConstraintResult, Deviation, Trust, split_results
from posefield.robots.standing_soles import StandingSoles
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
    def soles(self) -> StandingSoles | None:
        """Solver of the legs of a robot; None for other models."""
        card = self.session.card
        if card.robot is None:
            return None
        return StandingSoles(np, np.asarray, card.robot, card.soles, card.frames - 1)

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

    def question(self, question: MotionQuestion) -> ValidatedQuestion:
        """Return the validated question; open controls are conditional means.

        The means are conditional on the given controls and the targets. Raises InvalidField and
        OutsideSamples as the validation does.
        """
        check_take(question.take, question.variety)
        if question.take:
            random_field.check_features(self.session.card.kriging, question.take)
        policy, performer, level = question.extrapolate, question.performer, question.level
        validated = self.validator.question(
            question.controls, policy, performer, level, question.labels
        )
        if not (validated.inferred and question.targets):
            return validated
        # Validation comes first: the search for controls takes about a second.
        constraints = targets.from_question(self.session.card, validated, question)
        controls = self.solver.controls(validated, constraints.targets, self.validator.imputer)
        complete = self.validator.question(controls, policy, performer, level, question.labels)
        return replace(complete, inferred=validated.inferred)

    @cached_property
    def measures(self) -> bool:
        """True if a control is measured on the motion."""
        return any(control.measure for control in self.session.card.controls)

    def constraints(
        self, validated: ValidatedQuestion, question: MotionQuestion
    ) -> ConstraintSet | None:
        """Return the constraints of a question, or None for the prediction.

        Raises as `targets.from_question` does.
        """
        if not (question.has_constraints or self.measures):
            return None
        return targets.from_question(self.session.card, validated, question) or None

    def solve_constraints(
        self,
        question: ValidatedQuestion,
        constraints: ConstraintSet,
        extrapolate: ExtrapolationPolicy,
    ) -> ConstrainedMotion:
        """Return the motion that meets its targets.

        Raises OutOfReach for a missed target if `extrapolate` is "refuse".
        """
        motion = self.solver.solve(question, constraints)
        if extrapolate == "refuse":
            check_targets(constraints, motion.results)
        return motion

    def check_duration(self, duration: float) -> float:
        """Return the duration, s; OutsideSamples if extrapolation makes it implausible."""
        low, high = self.durations
        if not low <= duration <= high:
            raise OutsideSamples(
                "controls", question_validation.implausible_duration(self.session.card, duration)
            )
        return duration

    def trust(
        self, question: MotionQuestion, validated: ValidatedQuestion, duration: float, sigma: float
    ) -> Trust:
        """Return the trust of an answer with this duration, s, and sigma, m."""
        performer, deviations = validated.performer, validated.deviations
        warnings = validated.warnings
        if deviations:
            warnings = question_validation.merge_warnings(
                warnings, deviations, question.extrapolate
            )
        if question.detail and not self.session.card.making.detail:
            warnings = (*warnings, NO_DETAIL)
        has_performer = performer is not None or PERFORMER in validated.named_labels
        performer_seen = has_performer if self.session.card.performers else None
        shares = self.session.card.joint_sigma if question.joint_sigma else ()
        varies = question.take or question.detail
        take = take_variation.settings(self.session.card, question) if varies else None
        return Trust(
            self.identity,
            validated.controls,
            performer,
            validated.level,
            duration,
            sigma,
            validated.supported,
            warnings,
            performer_seen,
            inferred=validated.inferred,
            joint_sigma=tuple(round(share * sigma, MICROMETRES) for share in shares),
            deviations=deviations,
            labels=validated.named_labels,
            take={} if take is None else asdict(take),
        )

    def constrained_trust(
        self, question: MotionQuestion, validated: ValidatedQuestion, motion: ConstrainedMotion
    ) -> Trust:
        """Return the trust of a constrained answer, with the errors of its targets."""
        measured = constraint.measured(self.session.card, motion)
        controls, reached = split_results(motion.results, len(question.targets))
        deviations = self._deviations(validated, measured, controls)
        validated = replace(validated, deviations=deviations)
        trust = self.trust(question, validated, motion.duration, motion.state.asked_sigma)
        warnings = trust.warnings
        if reached and question.extrapolate != "ok":
            warnings = (*warnings, *miss_warnings(reached))
        return structs.replace(trust, warnings=warnings, measured=measured, targets=motion.results)

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
        by_control = {
            deviation.control: deviation
            for deviation in question.deviations
            if deviation.control not in reached
        }
        for control in self.session.card.controls:
            name = control.name
            if not reached.get(name, True):
                by_control[name] = question_validation.deviation(
                    control, question.controls[name], measured[name]
                )
        return tuple(by_control[name] for name in question.controls if name in by_control)


def miss_warnings(results: Sequence[ConstraintResult]) -> tuple[str, ...]:
    """Return a sentence for each constraint that is not met."""
    return tuple(_miss_warning(result) for result in results if not result.reached)


def check_targets(constraints: ConstraintSet, results: Sequence[ConstraintResult]) -> None:
    """Raise OutOfReach, which names the first, if a constraint is not met."""
    for field, result in zip(_constraint_fields(constraints, results), results, strict=True):
        if not result.reached:
            raise OutOfReach(field, "; ".join(miss_warnings(results)))


def _constraint_fields(
    constraints: ConstraintSet, results: Sequence[ConstraintResult]
) -> Iterator[str]:
    """Yield the field of each constraint in the question; controls precede targets."""
    controls, reached = split_results(results, len(constraints.targets))
    yield from (f"controls/{control.what}" for control in controls)
    yield from (f"targets/{index}" for index in range(len(reached)))


def _miss_warning(result: ConstraintResult) -> str:
    miss = (
        f"{100.0 * result.miss:.1f} cm"
        if result.unit == "m"
        else f"{result.miss:.3g} {result.unit}"
    )
    return f"{result.what} stays {miss} from its target: out of reach"
