"""Inference of controls from targets.

A control that is measured on the joint and at the moment of a target is read off the target. The
others are the conditional mean, given the joint positions that the model predicts for captured
clips.
"""

from collections.abc import Mapping

import numpy as np

from service.motion.card import ModelCard
from service.motion.conventions import Floats
from service.motion.measure import AXES
from service.synthesis.exact.goals import Goal


def read_off(
    card: ModelCard, given: Mapping[str, float], goals: tuple[Goal, ...]
) -> dict[str, float]:
    """Return values of controls that targets determine, limited to the sampled ranges.

    The targets remain constraints.
    """
    found = {}
    for goal in goals:
        for control in card.controls:
            own = control.measure
            if control.name in given or own is None or own.quantity not in AXES:
                continue
            same = (own.joints, own.at, own.share) == (
                goal.moment.joints,
                goal.moment.at,
                goal.moment.share,
            )
            if same and goal.time is None:
                value = float(goal.place[AXES[own.quantity]])
                # Beyond the sampled range, the correction approaches the target, not the model's
                # extrapolation.
                found[control.name] = min(max(value, control.minimum), control.maximum)
    return found


def wanted(goals: tuple[Goal, ...]) -> Floats:
    """Return the target positions (3 G,) of the goals, concatenated."""
    return np.array([value for goal in goals for value in goal.place])
