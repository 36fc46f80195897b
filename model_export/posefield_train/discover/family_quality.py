"""Quality of families of clips: how alike they are, and how much they move."""

from dataclasses import dataclass

import numpy as np

from posefield.common.units import Floats
from posefield_train.discover import subsequence_dtw
from posefield_train.discover.family_search import SHORTEST, Family
from posefield_train.discover.joined_features import JoinedFeatures

MOST_WITHIN = 0.2
"""Variance between the clips of a family as a share of that of all takes, from which on they are
too different."""
LEAST_SHARED = 0.5
"""Share of the variance of a family that its mean motion has, below which there is no motion that
the clips have in common."""


@dataclass(frozen=True)
class FamilyQuality:
    """Likeness of the clips of a family, and their common motion.

    within: mean variance between the clips at the same part of the motion. motion: variance of
    their mean over time; both as shares of the variance of all takes. seconds: median duration.
    """

    within: float
    motion: float
    seconds: float

    @property
    def shared(self) -> float:
        """Return the share of the variance that the mean motion has."""
        return self.motion / (self.motion + self.within)

    @property
    def reasons(self) -> tuple[str, ...]:
        """Return why the family is not offered; empty if it is."""
        found = []
        if self.seconds < SHORTEST:
            found.append(f"{self.seconds:.1f} s long, expected {SHORTEST:g} s or more")
        if self.within > MOST_WITHIN:
            found.append(
                f"clips differ by {self.within:.0%} of all motion, expected at most "
                f"{MOST_WITHIN:.0%}"
            )
        if self.shared < LEAST_SHARED:
            found.append(
                f"{self.shared:.0%} of its motion is common to the clips, expected "
                f"{LEAST_SHARED:.0%} or more"
            )
        return tuple(found)


def assess(joined: JoinedFeatures, family: Family) -> FamilyQuality:
    """Return the quality of a family, whose clips are aligned to its example."""
    aligned = align_members(joined, family)
    mean = aligned.mean(axis=0)
    within = float(np.square(aligned - mean).sum(axis=-1).mean())
    motion = float(np.square(mean - mean.mean(axis=0)).sum(axis=-1).mean())
    whole = joined.variance
    return FamilyQuality(within / whole, motion / whole, family.seconds)


def align_members(joined: JoinedFeatures, family: Family) -> Floats:
    """Return the features (M, L, k) of a family's clips at the frames of its example."""
    query = joined.clip(family.example)
    found = []
    for member in family.members:
        own = joined.clip(member.span)
        apart = np.linalg.norm(query[:, None] - own, axis=-1)
        found.append(own[subsequence_dtw.align(apart)])
    return np.stack(found)
