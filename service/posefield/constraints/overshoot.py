"""Bounds of corrected motions whose controls lie outside the sampled ranges.

The correction moves duration and travel as far as captured motions reach, from a prediction that
may itself lie beyond the requested value. Here the motion is brought back: to a duration within the
bounds, and to the requested value of each control that it passed on the side away from the samples.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from posefield.common.units import Floats
from posefield.constraints.constrained_motion import ConstrainedMotion, LevelCorrector
from posefield.constraints.constraint import TravelConstraint
from posefield.constraints.gauss_newton import MISS_TOLERANCE
from posefield.constraints.motion_variables import CYCLE_VARIABLES, MotionVariables
from posefield.constraints.targets import ConstraintSet
from posefield.model_file.answer_bounds import AnswerBounds
from posefield.model_file.model_card import Control
from posefield.question.results import ConstraintResult, split_results

# Speed depends on the travel, so it is last.
ORDER = ("turn", "stride_length", "speed")


def bring_back(
    bench: LevelCorrector,
    held: ConstrainedMotion,
    goals: ConstraintSet,
    asked: Mapping[str, float],
    bounds: AnswerBounds,
) -> ConstrainedMotion:
    """Return the corrected motion within the bounds, with errors relative to the asked controls.

    goals: of the correction, in which controls are limited. asked: controls as requested.
    """
    numbers = held.numbers
    if held.scene.cyclic:
        numbers = _limit_duration(held, bounds)
        for quantity in ORDER:
            for name, own, goal in goals.controls:
                if own.quantity == quantity:
                    aim = TravelConstraint((name,), quantity, np.array([goal]), own.unit)
                    control = bench.card.control(name)
                    assert control is not None
                    numbers = _without_overshoot(held.scene, numbers, aim, control)
    found = replace(held, numbers=numbers)
    measured = bench.measured(found)
    controls, targets = split_results(held.results, len(goals.targets))
    judged = [_result(met, asked, measured) for met in controls]
    return replace(found, results=(*judged, *targets))


def _limit_duration(held: ConstrainedMotion, bounds: AnswerBounds) -> Floats:
    """Return the numbers of a cycle, no shorter or longer than its prediction or the bounds."""
    predicted = held.state.duration
    least, most = bounds.duration_limits
    numbers = held.numbers.copy()
    numbers[-CYCLE_VARIABLES] = np.clip(
        numbers[-CYCLE_VARIABLES], np.log(min(least, predicted)), np.log(max(most, predicted))
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
    found = numbers.copy()
    if aim.quantity == "turn":
        found[-1] = np.radians(goal)
    elif aim.quantity == "stride_length":
        found[-CYCLE_VARIABLES + 1 : -1] *= goal / value
    else:
        found[-CYCLE_VARIABLES] += np.log(value / goal)
    return found


def _result(
    met: ConstraintResult, asked: Mapping[str, float], measured: Mapping[str, float]
) -> ConstraintResult:
    miss = abs(asked[met.what] - measured[met.what])
    return replace(met, miss=miss, reached=miss <= MISS_TOLERANCE)
