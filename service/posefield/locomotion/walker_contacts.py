"""Probabilities of the contacts of walking characters, at their levels of detail."""

from typing import Annotated

import numpy as np

from posefield.common.units import Floats, Indices
from posefield.inference.session import Session
from posefield.locomotion import stride
from posefield.locomotion.level_transitions import LevelSchedule
from posefield.locomotion.locomotion_plan import LocomotionPlan
from posefield.locomotion.walking_crowd import POSES_PER_CALL, Pairs


def contact_probabilities(
    session: Session, plan: LocomotionPlan, who: Annotated[Indices, "motions"], shown: LevelSchedule
) -> Annotated[Floats, "motions frames contacts"]:
    """Return the probabilities (M, F, C) of the contacts of characters (M,) of the plan.

    shown: levels (M, F); where they change, probabilities are blended as the poses are.
    """
    shape = (len(who), plan.phases.shape[1])
    count = shape[0] * shape[1]
    found = np.empty((count, len(session.card.contacts)))
    for rows in (slice(first, first + POSES_PER_CALL) for first in range(0, count, POSES_PER_CALL)):
        character, frame = np.divmod(np.arange(count)[rows], shape[1])
        found[rows] = _blended(session, plan, (who[character], frame), shown.rows(rows))
    return found.reshape(*shape, -1)


def _blended(
    session: Session, plan: LocomotionPlan, pairs: Pairs, shown: LevelSchedule
) -> Annotated[Floats, "pairs contacts"]:
    """Return the probabilities of K pairs of a character and a frame."""
    found, shares = _at_levels(session, plan, pairs, shown.levels), shown.shares
    between = np.flatnonzero(shares < 1.0)
    if len(between):
        some = pairs[0][between], pairs[1][between]
        before = _at_levels(session, plan, some, shown.previous[between])
        found[between] = before + shares[between, None] * (found[between] - before)
    return found


def _at_levels(
    session: Session, plan: LocomotionPlan, pairs: Pairs, levels: Indices
) -> Annotated[Floats, "pairs contacts"]:
    """Return the probabilities of K pairs, each at its level (K,)."""
    found = np.empty((len(levels), len(session.card.contacts)))
    for level in np.unique(levels).tolist():
        rows = np.flatnonzero(levels == level)
        pair = pairs[0][rows], pairs[1][rows]
        labels = plan.labels.weights[plan.who[pair[0]]]
        found[rows] = stride.contact_probabilities(
            session, plan.controls[pair], labels, plan.phases[pair], level
        )
    return found
