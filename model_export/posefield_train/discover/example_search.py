"""Search for motions like examples: a ranked list of clips of all takes."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from posefield.common.units import Floats
from posefield_train.discover import subsequence_dtw
from posefield_train.discover.motion_features import SEARCH_RATE, Corpus
from posefield_train.discover.subsequence_dtw import Ends

GAP = 2
"""Frames between two takes, so that no match leads from one to the next."""
LARGEST_OVERLAP = 0.2
"""Largest share of the shorter of two clips that they may have in common."""
REJECTED_OVERLAP = 0.5
"""Largest share of a rejected clip that a clip may have in common with it."""
SOFTNESS = 0.1
"""Difference of relative costs at which a farther example still counts."""


@dataclass(frozen=True)
class Span:
    """Part of a take. take: index. start, end: s."""

    take: int
    start: float
    end: float

    def overlap(self, other: "Span") -> float:
        """Return the common time as a share of the shorter one."""
        if self.take != other.take:
            return 0.0
        common = min(self.end, other.end) - max(self.start, other.start)
        return max(common, 0.0) / min(self.end - self.start, other.end - other.start)


@dataclass(frozen=True)
class Match:
    """A clip like the example. cost: distance as a share of that of any clip of the takes."""

    span: Span
    cost: float


def find_like(
    corpus: Corpus, examples: Sequence[Span], most: int, rejected: Sequence[Span] = ()
) -> list[Match]:
    """Return the clips that are most like examples, the best first, without the examples.

    Clips overlap neither the examples nor each other by more than LARGEST_OVERLAP, and no rejected
    part by more than half. Costs are relative to the median over all places where a clip may end.
    """
    joined, owners, offsets = _joined(corpus.features)
    ends = _nearest([_relative_ends(corpus, one, joined) for one in examples])
    kept = list(examples)
    found: list[Match] = []
    for end in _by_cost(ends.costs):
        if len(found) == most:
            break
        take = int(owners[end])
        start, stop = ((frame - offsets[take]) / SEARCH_RATE for frame in (ends.starts[end], end))
        span = Span(take, float(start), float(stop))
        if any(span.overlap(other) > REJECTED_OVERLAP for other in rejected):
            continue
        if all(span.overlap(other) <= LARGEST_OVERLAP for other in kept):
            kept.append(span)
            found.append(Match(span, float(ends.costs[end])))
    return found


def _relative_ends(corpus: Corpus, example: Span, joined: Floats) -> Ends:
    """Return the best match for each last frame, with costs relative to the usual one."""
    first, last = round(example.start * SEARCH_RATE), round(example.end * SEARCH_RATE)
    query = corpus.features[example.take][first : last + 1]
    ends = subsequence_dtw.match_ends(subsequence_dtw.distances(query, joined))
    usual = float(np.median(ends.costs[np.isfinite(ends.costs)]))
    return Ends(ends.costs / usual, ends.starts)


def _nearest(several: Sequence[Ends]) -> Ends:
    """Return the match of the nearest example for each last frame, its cost by all of them.

    The cost is a soft minimum: a clip near two examples comes before one that is near to one.
    """
    costs = np.stack([one.costs for one in several])
    starts = np.stack([one.starts for one in several])
    best = np.argmin(costs, axis=0)
    columns = np.arange(costs.shape[1])
    least = costs[best, columns]
    known = np.isfinite(least)
    soft = least.copy()
    near = np.exp((least[known] - costs[:, known]) / SOFTNESS)
    soft[known] -= SOFTNESS * np.log(near.mean(axis=0))
    return Ends(soft, starts[best, columns])


def _by_cost(costs: Floats) -> Iterator[int]:
    """Yield the frames with a finite cost, the lowest first."""
    for end in np.argsort(costs, kind="stable"):
        if not np.isfinite(costs[end]):
            return
        yield int(end)


def _joined(features: Sequence[Floats]) -> tuple[Floats, Floats, list[int]]:
    """Return the features of all takes (F, k) with gaps, each frame's take, and each take's begin.

    Gaps are NaN, and of take -1.
    """
    pieces, owners, offsets, count = [], [], [], 0
    for take, own in enumerate(features):
        offsets.append(count)
        pieces += [own, np.full((GAP, own.shape[1]), np.nan)]
        owners += [np.full(len(own), take), np.full(GAP, -1)]
        count += len(own) + GAP
    return np.concatenate(pieces), np.concatenate(owners), offsets
