"""Search for motions like examples: a ranked list of clips of all takes."""

from collections.abc import Iterator, Sequence

import numpy as np

from posefield.common.units import Floats
from posefield_train.discover import joined_features
from posefield_train.discover.joined_features import Match, Span
from posefield_train.discover.motion_features import Corpus
from posefield_train.discover.subsequence_dtw import Ends

LARGEST_OVERLAP = 0.2
"""Largest share of the shorter of two clips that they may have in common."""
REJECTED_OVERLAP = 0.5
"""Largest share of a rejected clip that a clip may have in common with it."""
SOFTNESS = 0.1
"""Difference of relative costs at which a farther example still counts."""


def find_like(
    corpus: Corpus, examples: Sequence[Span], most: int, rejected: Sequence[Span] = ()
) -> list[Match]:
    """Return the clips that are most like examples, the best first, without the examples.

    Clips overlap neither the examples nor each other by more than LARGEST_OVERLAP, and no rejected
    part by more than half; within them no joint leaps. Costs are relative to the median over all
    places where a clip may end.
    """
    joined = joined_features.join_features(corpus)
    ends = _nearest([joined.ends(one) for one in examples])
    kept = list(examples)
    found: list[Match] = []
    for end in _by_cost(ends.costs):
        if len(found) == most:
            break
        span = joined.span(int(ends.starts[end]), end)
        if not corpus.is_whole(span.take, span.start, span.end):
            continue
        if any(span.overlap(other) > REJECTED_OVERLAP for other in rejected):
            continue
        if all(span.overlap(other) <= LARGEST_OVERLAP for other in kept):
            kept.append(span)
            found.append(Match(span, float(ends.costs[end])))
    return found


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
