"""Features of all takes one after another, in which clips are searched at once."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from posefield.common.units import Floats, Indices
from posefield_train.discover import subsequence_dtw
from posefield_train.discover.motion_features import SEARCH_RATE, Corpus
from posefield_train.discover.subsequence_dtw import Ends, SearchedFrames

GAP = 2
"""Frames between two takes, so that no match leads from one to the next."""


@dataclass(frozen=True)
class Span:
    """Part of a take. take: index. start, end: s."""

    take: int
    start: float
    end: float

    @property
    def seconds(self) -> float:
        """Return the duration, s."""
        return self.end - self.start

    def overlap(self, other: "Span") -> float:
        """Return the common time as a share of the shorter one."""
        if self.take != other.take:
            return 0.0
        common = min(self.end, other.end) - max(self.start, other.start)
        return max(common, 0.0) / min(self.seconds, other.seconds)


@dataclass(frozen=True)
class Match:
    """A clip that is like another one. cost: distance as a share of that of any clip."""

    span: Span
    cost: float


@dataclass(frozen=True)
class JoinedFeatures:
    """Features of takes in a row.

    values (F, k): NaN in the gaps between takes. owners (F,): take of each frame, -1 in gaps.
    offsets: first frame of each take.
    """

    values: Floats
    owners: Indices
    offsets: tuple[int, ...]

    @cached_property
    def variance(self) -> float:
        """Variance of all features, summed over the directions."""
        return float(self.values[self.owners >= 0].var(axis=0).sum())

    @cached_property
    def _searched(self) -> SearchedFrames:
        return subsequence_dtw.searched_frames(self.values)

    def frames(self, span: Span) -> slice:
        """Return the frames of a part of a take; its end may lie beyond the last one."""
        offset = self.offsets[span.take]
        first, last = (offset + round(time * SEARCH_RATE) for time in (span.start, span.end))
        ends = (
            len(self.owners) if span.take + 1 == len(self.offsets) else self.offsets[span.take + 1]
        )
        return slice(first, min(last + 1, ends - GAP))

    def clip(self, span: Span) -> Floats:
        """Return the features (L, k) of a part of a take."""
        return self.values[self.frames(span)]

    def span(self, first: int, last: int) -> Span:
        """Return the part of a take between two frames, both included."""
        take = int(self.owners[last])
        start, end = ((frame - self.offsets[take]) / SEARCH_RATE for frame in (first, last))
        return Span(take, float(start), float(end))

    def ends(self, span: Span) -> Ends:
        """Return the best match of a clip for each last frame, with relative costs.

        Costs are shares of the median over all places where a clip may end.
        """
        apart = subsequence_dtw.distances(self.clip(span), self._searched)
        found = subsequence_dtw.match_ends(apart)
        usual = float(np.median(found.costs[np.isfinite(found.costs)]))
        return Ends(found.costs / usual, found.starts)


def join_features(corpus: Corpus) -> JoinedFeatures:
    """Return the features of all takes with gaps between them."""
    pieces, owners, offsets, count = [], [], [], 0
    for take, own in enumerate(corpus.features):
        offsets.append(count)
        pieces += [own, np.full((GAP, own.shape[1]), np.nan)]
        owners += [np.full(len(own), take), np.full(GAP, -1)]
        count += len(own) + GAP
    return JoinedFeatures(np.concatenate(pieces), np.concatenate(owners), tuple(offsets))
