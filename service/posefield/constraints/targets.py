"""Constraints of a question, validated, and bounds of motions that are corrected for them.

A correction moves duration and travel as far as captured motions reach, from a prediction that may
itself lie beyond the requested value of a control outside the sampled ranges.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from posefield.common.errors import InvalidField, did_you_mean
from posefield.common.units import Floats
from posefield.constraints import constraint, take_variation
from posefield.constraints.constrained_motion import (
    CYCLE_VARIABLES,
    ConstrainedMotion,
    MotionVariables,
)
from posefield.constraints.constraint import TravelConstraint
from posefield.constraints.gauss_newton import MISS_TOLERANCE, LevelCorrector
from posefield.constraints.take_variation import TakeSettings
from posefield.inference import session
from posefield.inference.session import AnswerBounds
from posefield.model_file.model_card import Control, ModelCard
from posefield.motion.measures import POSITION_AXES, Measure
from posefield.question import motion_question
from posefield.question.motion_question import ClipQuestion, MotionQuestion, Target
from posefield.question.results import ConstraintResult, split_results
from posefield.validation import question_validation
from posefield.validation.question_validation import ValidatedQuestion

# Largest coordinate of a target, m: beyond any human reach, and well within float32.
MAX_COORDINATE = 100.0
MAX_TARGETS = 32
OPEN_COST = 4
"""Cost of a target of a clip with open controls, relative to the cost of a target."""


@dataclass(frozen=True)
class JointTarget:
    """Target position of a joint.

    moment: rule that determines the moment. position: (3,), m. time: s, None for a moment without
    one. slack: by which it may lie behind the end, s, which a clip plays at its nearest frame.
    """

    name: str
    moment: Measure
    position: tuple[float, float, float]
    time: float | None
    slack: float = 0.0


@dataclass(frozen=True)
class ConstraintSet:
    """Constraints of a question.

    controls: measured controls with their target values. targets: target positions of joints.
    take: deviation of the motion that the constraints correct; None for the prediction itself.
    """

    controls: tuple[tuple[str, Measure, float], ...]
    targets: tuple[JointTarget, ...]
    take: TakeSettings | None = None

    def __bool__(self) -> bool:
        return bool(self.controls or self.targets or self.take)

    @property
    def corrects(self) -> bool:
        """Return whether there is anything to correct."""
        return bool(self.controls or self.targets)


NO_CONSTRAINTS = ConstraintSet((), ())


def solver_cost(card: ModelCard, question: MotionQuestion) -> int:
    """Return the cost of solving the constraints of a question, in units of a plain target.

    Open controls cost several units.
    """
    cost = OPEN_COST if len(question.controls) < len(card.controls) else 1
    return cost * len(question.targets)


def from_question(
    card: ModelCard, validated: ValidatedQuestion, question: MotionQuestion
) -> ConstraintSet:
    """Return the constraints of a question.

    Raises InvalidField for a control that is not measured on a motion, an unknown joint, an invalid
    position or time, and two targets for one joint at one moment.
    """
    slack = 0.0
    if isinstance(question, ClipQuestion) and question.fps >= 1.0:
        slack = 0.5 / question.fps
    targets = tuple(
        replace(_joint_target(card, i, target), slack=slack)
        for i, target in enumerate(question.targets)
    )
    if targets:
        _check_duplicates(question.targets, targets)
    targeted = {goal.moment for goal in targets if goal.time is None}
    has_names = question.exact not in ("auto", "none")
    controls = []
    for control in _exact_controls(card, validated, question):
        measure = control.measure
        assert measure is not None
        if (
            measure.quantity in POSITION_AXES
            and Measure("height", measure.joints, measure.at, measure.share) in targeted
        ):
            # The target of the same joint is more specific than a control that was not named in
            # `exact`.
            if has_names:
                raise InvalidField("exact", f"{control.name!r}, for whose joint there is a target")
            continue
        goal = session.limit_control(control, validated.controls[control.name])
        controls.append((control.name, measure, goal))
    varies = question.take or question.detail
    take = take_variation.settings(card, question) if varies else None
    return ConstraintSet(tuple(controls), targets, take)


def _exact_controls(
    card: ModelCard, validated: ValidatedQuestion, question: MotionQuestion
) -> Sequence[Control]:
    """Return the controls whose measured values the answer must match."""
    received = [c for c in card.controls if c.name not in validated.inferred]
    movable = [c.name for c in card.controls if c.measure and not c.measure.is_body_measure]
    if question.exact == "none":
        return ()
    if question.exact == "auto":
        return [control for control in received if control.name in movable]
    for name in question.exact:
        control = card.control(name)
        if control is None:
            names = [c.name for c in card.controls]
            hint = did_you_mean(name, names)
            expected = f"expected controls of this model: {', '.join(names)}"
            raise InvalidField("exact", f"{name!r}{hint}, {expected}")
        if name not in movable:
            raise InvalidField(
                "exact",
                f"{name!r} is not measured on a motion, "
                f"expected some of: {', '.join(movable) or 'none'}",
            )
        if name in validated.inferred:
            raise InvalidField("exact", f"{name!r} was not given, expected a control that was")
    return [control for control in received if control.name in question.exact]


def _joint_target(card: ModelCard, index: int, target: Target) -> JointTarget:
    field = f"targets/{index}"
    if index >= MAX_TARGETS:
        raise InvalidField("targets", f"more than {MAX_TARGETS}")
    if target.joint not in card.skeleton.names:
        names = ", ".join(card.skeleton.names)
        hint = did_you_mean(target.joint, card.skeleton.names)
        raise InvalidField(f"{field}/joint", f"{target.joint!r}{hint}, expected one of {names}")
    joint = card.skeleton.names.index(target.joint)
    if len(target.position) != 3:
        raise InvalidField(f"{field}/position", f"{len(target.position)} numbers, expected three")
    x, y, z = (
        motion_question.check_number(f"{field}/position/{a}", v)
        for a, v in enumerate(target.position)
    )
    for axis, value in enumerate((x, y, z)):
        motion_question.check_range(
            f"{field}/position/{axis}", value, -MAX_COORDINATE, MAX_COORDINATE, "m"
        )
    when = target.when
    if not isinstance(when, str):
        time = motion_question.check_number(f"{field}/time", when)
        if not 0.0 <= time <= question_validation.duration_range(card)[1]:
            raise InvalidField(
                f"{field}/time",
                f"{time:g} s, expected 0 to the clip's duration; captured clips last at most "
                f"{card.durations[1]:.3g} s",
            )
        moment = Measure("height", (joint,), "landmark")
        return JointTarget(f"{target.joint} at {time:g} s", moment, (x, y, z), time)
    return JointTarget(
        f"{target.joint} at {when}", _moment(card, field, joint, when), (x, y, z), None
    )


def _moment(card: ModelCard, field: str, joint: int, when: str) -> Measure:
    if when != "event":
        return Measure("height", (joint,), when)  # type: ignore[arg-type]
    if card.event is None:
        raise InvalidField(f"{field}/at", "'event', but this model's recipe names none")
    if card.event.share in (0.0, 1.0):
        return Measure("height", (joint,), "start" if card.event.share == 0.0 else "end")
    return Measure("height", (joint,), "landmark", card.event.share)


def _check_duplicates(targets: Sequence[Target], goals: Sequence[JointTarget]) -> None:
    indices: dict[object, int] = {}
    for index, (target, goal) in enumerate(zip(targets, goals, strict=True)):
        key = (target.joint, goal.time, goal.moment)
        if key in indices:
            raise InvalidField(
                f"targets/{index}",
                f"{goal.name} has a target already (targets/{indices[key]}), expected one",
            )
        indices[key] = index


# Speed depends on the travel, so it is last.
ORDER = ("turn", "stride_length", "speed")


def bring_back(
    corrector: LevelCorrector,
    motion: ConstrainedMotion,
    goals: ConstraintSet,
    requested: Mapping[str, float],
    bounds: AnswerBounds,
) -> ConstrainedMotion:
    """Return the corrected motion within the bounds, with errors from the requested controls.

    goals: of the correction, in which controls are limited. requested: controls as requested.
    """
    numbers = motion.numbers
    if motion.scene.cyclic:
        numbers = _limit_duration(motion, bounds)
        for quantity in ORDER:
            for name, measure, goal in goals.controls:
                if measure.quantity == quantity:
                    aim = TravelConstraint((name,), quantity, np.array([goal]), measure.unit)
                    control = corrector.card.control(name)
                    assert control is not None
                    numbers = _without_overshoot(motion.scene, numbers, aim, control)
    bounded = replace(motion, numbers=numbers)
    measured = constraint.measured(corrector.card, bounded)
    controls, targets = split_results(motion.results, len(goals.targets))
    results = [_result(met, requested, measured) for met in controls]
    return replace(bounded, results=(*results, *targets))


def _limit_duration(motion: ConstrainedMotion, bounds: AnswerBounds) -> Floats:
    """Return the numbers of a cycle, no shorter or longer than its prediction or the bounds."""
    predicted = motion.state.duration
    shortest, longest = bounds.duration_limits
    numbers = motion.numbers.copy()
    numbers[-CYCLE_VARIABLES] = np.clip(
        numbers[-CYCLE_VARIABLES], np.log(min(shortest, predicted)), np.log(max(longest, predicted))
    )
    return numbers


def _without_overshoot(
    scene: MotionVariables, numbers: Floats, aim: TravelConstraint, control: Control
) -> Floats:
    """Return the numbers with the goal's value where the motion passed it, else unchanged."""
    value, goal = float(aim.evaluate(scene, numbers)[0][0]), float(aim.target[0])
    above = goal > control.maximum and value > goal
    below = goal < control.minimum and value < goal
    if not (above or below):
        return numbers
    limited = numbers.copy()
    if aim.quantity == "turn":
        limited[-1] = np.radians(goal)
    elif aim.quantity == "stride_length":
        limited[-CYCLE_VARIABLES + 1 : -1] *= goal / value
    else:
        limited[-CYCLE_VARIABLES] += np.log(value / goal)
    return limited


def _result(
    met: ConstraintResult, requested: Mapping[str, float], measured: Mapping[str, float]
) -> ConstraintResult:
    miss = abs(requested[met.what] - measured[met.what])
    return replace(met, miss=miss, reached=miss <= MISS_TOLERANCE)
