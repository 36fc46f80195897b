"""Limits of the knees and elbows of a character that moves by several models."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from posefield.model_file.model_card import ModelCard
from posefield.motion import hinges, quat
from posefield.motion.hinges import Hinge
from posefield.performance.passage import SkeletonMatch, SkeletonsDiffer, match_skeletons


def shared_hinges(card: ModelCard, others: Sequence[ModelCard]) -> tuple[Hinge, ...]:
    """Return the hinges of a character's model, whose ranges include those of other models.

    Empty where one of the models has none, or another skeleton.
    """
    widened = list(card.hinges)
    for other in {own.name: own for own in others}.values():
        try:
            match = match_skeletons(other.skeleton, card.skeleton)
        except SkeletonsDiffer:
            return ()
        known = {hinge.joint: hinge for hinge in other.hinges}
        widened = [
            _widened(hinge, known[hinge.joint], match) for hinge in widened if hinge.joint in known
        ]
    return tuple(widened)


def _widened(hinge: Hinge, other: Hinge, match: SkeletonMatch) -> Hinge:
    """Return a hinge whose range includes that of the same joint in a skeleton that it matches."""
    rotations = np.tile(quat.IDENTITY, (len(match.parents), 1))
    rotations[other.joint] = other.reference
    # The straight limb of the other skeleton is bent a little by the hinge of this one.
    shift = hinges.from_card((hinge,)).angles(match.rotations(rotations))[0]
    return replace(
        hinge,
        low=hinges.rounded(np.minimum(hinge.low, other.low + shift)),
        high=hinges.rounded(np.maximum(hinge.high, other.high + shift)),
    )
