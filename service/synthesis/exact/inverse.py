"""Controls of a question that gives targets instead: the most typical for what is to be met.

A control that is measured on the very joint and at the very moment of a target is read off it. The
others are those that captured motions have whose joints the model puts there.
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
    """Values of controls that were not given and that a target is about, within what was sampled:
    the target itself goes on asking for the rest."""
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
                # What lies beyond is the correction's to approach, not the model's to guess.
                found[control.name] = min(max(value, control.minimum), control.maximum)
    return found


def wanted(goals: tuple[Goal, ...]) -> Floats:
    """Places (3 G,) that goals ask for, one after the other."""
    return np.array([value for goal in goals for value in goal.place])
