"""Families of similar motions in recordings, found without an example.

Recordings are not segmented: each pair of minima of the pose's speed that is 0.7 to 5 s apart may
be a clip. A sample of these candidates is searched in all recordings, and families are taken
greedily, that first which explains most of what is not yet explained.
"""

import heapq
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from posefield.common.units import Floats, Indices
from posefield_train.discover import motion_features
from posefield_train.discover.motion_features import (
    RATE,
    Corpus,
    Ends,
    JoinedFeatures,
    Match,
    Span,
    align,
)
from posefield_train.discover.recordings import Recording

LARGEST_OVERLAP = 0.2
"""Largest share of the shorter of two clips that they may have in common."""
REJECTED_OVERLAP = 0.5
"""Largest share of a rejected clip that a clip may have in common with it."""
SOFTNESS = 0.1
"""Difference of relative costs at which a farther example still counts."""


def find_like(
    corpus: Corpus, examples: Sequence[Span], count: int, rejected: Sequence[Span] = ()
) -> list[Match]:
    """Return the clips that are most like examples, the best first, without the examples.

    Clips overlap neither the examples nor each other by more than LARGEST_OVERLAP, and no rejected
    part by more than half; within them no joint leaps. Costs are relative to the median over all
    places where a clip may end.
    """
    joined = motion_features.join_features(corpus)
    best_ends = _nearest([joined.ends(one) for one in examples])
    spans = list(examples)
    matches: list[Match] = []
    for end in map(int, np.argsort(best_ends.costs, kind="stable")):
        if len(matches) == count or not np.isfinite(best_ends.costs[end]):
            break
        span = joined.span(int(best_ends.starts[end]), end)
        if not corpus.is_whole(span):
            continue
        if any(span.overlap(other) > REJECTED_OVERLAP for other in rejected):
            continue
        if all(span.overlap(other) <= LARGEST_OVERLAP for other in spans):
            spans.append(span)
            matches.append(Match(span, float(best_ends.costs[end])))
    return matches


def _nearest(several: Sequence[Ends]) -> Ends:
    """Return the match of the nearest example for each last frame, its cost by all of them.

    The cost is a soft minimum: a clip near two examples comes before one that is near to one.
    """
    costs = np.stack([one.costs for one in several])
    starts = np.stack([one.starts for one in several])
    best = np.argmin(costs, axis=0)
    columns = np.arange(costs.shape[1])
    smallest = costs[best, columns]
    finite = np.isfinite(smallest)
    soft = smallest.copy()
    near = np.exp((smallest[finite] - costs[:, finite]) / SOFTNESS)
    soft[finite] -= SOFTNESS * np.log(near.mean(axis=0))
    return Ends(soft, starts[best, columns])


SHORTEST, LONGEST = 0.7, 5.0
"""Duration of a candidate, s."""
MINIMUM_SPAN = 5
"""Frames at RATE on both sides of a minimum of the speed in which none is lower: 0.17 s."""
SMOOTHED = 5
"""Frames at RATE over which the speed is averaged."""
LEAST_MOTION = 0.02
"""Variance of the pose within a candidate as a share of that of all recordings, below which it is a
rest and no motion."""
CANDIDATES = 1_000
"""Number of candidates that are searched."""
LARGEST_COST = 0.55
"""Cost of a match relative to any clip, above which it does not belong to the family.

Precision and recall on recordings with known cuts hardly change between 0.5 and 0.6."""
FREE = 0.8
"""Share of a clip's frames that no earlier family has."""
FEWEST = 5
"""Fewest clips of a family."""


@dataclass(frozen=True)
class Family:
    """Similar clips. example: the clip that they are like. members: the most similar first."""

    example: Span
    members: tuple[Match, ...]

    @property
    def seconds(self) -> float:
        """Return the median duration, s."""
        return float(np.median([member.span.seconds for member in self.members]))


def find_families(
    corpus: Corpus, count: int = CANDIDATES, report: Callable[[int], None] = lambda _: None
) -> list[Family]:
    """Return the families of a corpus, that first which explains most of it.

    count: of candidates that are searched, evenly spread over all; those within which a joint leaps
    are not. report: called with the number of candidates that were searched. Clips of different
    families share few frames.
    """
    joined = motion_features.join_features(corpus)
    threshold = LEAST_MOTION * joined.variance
    spans = candidates(corpus)
    listed = [span for span in spans if joined.clip(span).var(axis=0).sum() > threshold]
    picked = (
        listed
        if len(listed) <= count
        else [listed[at] for at in np.linspace(0, len(listed) - 1, count).round().astype(int)]
    )
    matches = []
    for searched, span in enumerate(picked, 1):
        # Left out after they were picked, so that a leap of one recording changes no other's
        # candidates.
        if corpus.is_whole(span):
            matches.append(_matches(joined, span))
        report(searched)
    return _cover(joined, matches)


def candidates(corpus: Corpus) -> list[Span]:
    """Return all parts of recordings of a clip's duration between minima of the pose's speed."""
    spans = []
    for index, recording in enumerate(corpus.recordings):
        times = speed_minima(recording, corpus.roles)
        for start in times:
            within = times[(times >= start + SHORTEST) & (times <= start + LONGEST)]
            spans += [Span(index, float(start), float(end)) for end in within]
    return spans


def speed_minima(recording: Recording, roles: Sequence[str]) -> Floats:
    """Return the times (M,), s, at which the pose of a recording is slowest, and of its ends."""
    positions = motion_features.recording_features(recording, roles)[:, : 3 * len(roles)]
    speed = np.linalg.norm(np.gradient(positions, axis=0), axis=1)
    half = SMOOTHED // 2
    smooth = np.convolve(np.pad(speed, half, "edge"), np.full(SMOOTHED, 1 / SMOOTHED), "valid")
    padded = np.pad(smooth, MINIMUM_SPAN, constant_values=np.inf)
    windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * MINIMUM_SPAN + 1)
    lowest = np.flatnonzero(smooth == windows.min(axis=1))
    return np.unique([0, *lowest, len(smooth) - 1]) / RATE


@dataclass(frozen=True)
class _Matches:
    """Matches of a candidate as first and last frames (M,) with their costs (M,)."""

    example: Span
    firsts: Indices
    lasts: Indices
    costs: Floats


def _matches(joined: JoinedFeatures, span: Span) -> _Matches:
    """Return the clips like a candidate, the best first, that hardly overlap each other."""
    best_ends = joined.ends(span)
    near = np.flatnonzero(best_ends.costs < LARGEST_COST)
    near = near[np.argsort(best_ends.costs[near], kind="stable")]
    firsts, lasts = best_ends.starts[near], near
    indices: list[int] = []
    open_ = np.ones(len(near), dtype=bool)
    while open_.any():
        best = int(np.argmax(open_))
        indices.append(best)
        common = np.minimum(lasts, lasts[best]) - np.maximum(firsts, firsts[best])
        shorter = np.minimum(lasts - firsts, lasts[best] - firsts[best])
        open_ &= common <= LARGEST_OVERLAP * shorter
        open_[best] = False
    return _Matches(span, firsts[indices], lasts[indices], best_ends.costs[near][indices])


def _cover(joined: JoinedFeatures, matches: Sequence[_Matches]) -> list[Family]:
    """Return families, each the candidate's that explains most of what is free."""
    free = np.ones(len(joined.values))
    # What a candidate explains never grows, so that an old value bounds the new one from above.
    bounds = [(-_gain(candidate, free)[0], at) for at, candidate in enumerate(matches)]
    heapq.heapify(bounds)
    families = []
    while bounds:
        _, at = heapq.heappop(bounds)
        candidate = matches[at]
        gain, indices = _gain(candidate, free)
        if len(indices) < FEWEST:
            continue
        if bounds and gain < -bounds[0][0]:
            heapq.heappush(bounds, (-gain, at))
            continue
        members = []
        for member in indices:
            first, last = int(candidate.firsts[member]), int(candidate.lasts[member])
            free[first : last + 1] = 0.0
            members.append(Match(joined.span(first, last), float(candidate.costs[member])))
        families.append(Family(candidate.example, tuple(members)))
    return families


def _gain(matches: _Matches, free: Floats) -> tuple[float, list[int]]:
    """Return how much a candidate explains, and its matches that are mostly free."""
    before = np.concatenate([[0.0], np.cumsum(free)])
    within = before[matches.lasts + 1] - before[matches.firsts]
    indices = np.flatnonzero(within > FREE * (matches.lasts + 1 - matches.firsts))
    gains = (1.0 - matches.costs[indices] / LARGEST_COST) * within[indices]
    return float(gains.sum()), indices.tolist()


MOST_WITHIN = 0.2
"""Variance between the clips of a family as a share of that of all recordings, from which on they
are too different."""
LEAST_SHARED = 0.5
"""Share of the variance of a family that its mean motion has, below which there is no motion that
the clips have in common."""


@dataclass(frozen=True)
class FamilyQuality:
    """Likeness of the clips of a family, and their common motion.

    within: mean variance between the clips at the same part of the motion. motion: variance of
    their mean over time; both as shares of the variance of all recordings. seconds: median
    duration.
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
        sentences = []
        if self.seconds < SHORTEST:
            sentences.append(f"{self.seconds:.1f} s long, expected {SHORTEST:g} s or more")
        if self.within > MOST_WITHIN:
            sentences.append(
                f"clips differ by {self.within:.0%} of all motion, expected at most "
                f"{MOST_WITHIN:.0%}"
            )
        if self.shared < LEAST_SHARED:
            sentences.append(
                f"{self.shared:.0%} of its motion is common to the clips, expected "
                f"{LEAST_SHARED:.0%} or more"
            )
        return tuple(sentences)


def assess(joined: JoinedFeatures, family: Family) -> FamilyQuality:
    """Return the quality of a family, whose clips are aligned to its example."""
    query = joined.clip(family.example)
    members = []
    for member in family.members:
        clip = joined.clip(member.span)
        distances = np.linalg.norm(query[:, None] - clip, axis=-1)
        members.append(clip[align(distances)])
    aligned = np.stack(members)
    mean = aligned.mean(axis=0)
    within = float(np.square(aligned - mean).sum(axis=-1).mean())
    motion = float(np.square(mean - mean.mean(axis=0)).sum(axis=-1).mean())
    variance = joined.variance
    return FamilyQuality(within / variance, motion / variance, family.seconds)
