"""Tests of the search for motions like an example."""

import discover_takes
import numpy as np
import pytest

from posefield_train.discover import family_search, motion_features
from posefield_train.discover.motion_features import Span

PLANTED = ((0, 4.0, 2.0), (0, 12.0, 1.6), (1, 5.0, 2.4), (1, 15.0, 2.0), (2, 9.0, 1.8))
"""Recording, begin and duration, s, of a raised hand in recordings of other movements."""


def waving(seed, raises):
    """Movements (F, 3) of a hand over 20 s: slow noise, and raises at (begin, duration)."""
    rng = np.random.default_rng(seed)
    times = np.arange(round(20.0 * discover_takes.RATE) + 1) / discover_takes.RATE
    found = np.zeros((len(times), 3))
    for axis in range(3):
        knots = rng.normal(0.0, 0.08, 21)
        found[:, axis] = np.interp(times, np.arange(21.0), knots)
    for begin, duration in raises:
        share = np.clip((times - begin) / duration, 0.0, 1.0)
        found[:, 1] += 0.8 * np.sin(np.pi * share) ** 2
        found[:, 2] += 0.3 * np.sin(2.0 * np.pi * share)
    return found


@pytest.fixture(scope="module")
def corpus():
    """Three recordings that go to different places and face elsewhere, with planted motions."""
    recordings = []
    for index in range(3):
        raises = [(begin, duration) for recording, begin, duration in PLANTED if recording == index]
        hands = waving(index, raises)
        recordings.append(
            discover_takes.recording(
                f"{index}.bvh", 20.0, hands=hands, heading=2.0 * index, speed=0.1
            )
        )
    return motion_features.build_corpus(recordings)


@pytest.mark.parametrize("query", range(len(PLANTED)))
def test_planted_motions_come_first(corpus, query):
    recording, begin, duration = PLANTED[query]
    found = family_search.find_like(corpus, [Span(recording, begin, begin + duration)], 8)
    expected = {one for one in PLANTED if one != PLANTED[query]}
    best = [match.span for match in found[:4]]
    for other, start, seconds in expected:
        wanted = Span(other, start, start + seconds)
        assert max(shared(span, wanted) for span in best) > 0.65, (wanted, best)
    costs = [match.cost for match in found]
    assert costs == sorted(costs) and costs[3] < 0.75 * costs[4]


def test_further_examples_and_rejections_change_the_list(corpus):
    first, second = (
        Span(recording, begin, begin + length) for recording, begin, length in PLANTED[:2]
    )
    alone = family_search.find_like(corpus, [first], 6)
    assert family_search.find_like(corpus, [first, first], 6) == [
        family_search.Match(match.span, pytest.approx(match.cost)) for match in alone
    ]
    both = family_search.find_like(corpus, [first, second], 6)
    assert all(match.span.overlap(second) <= 0.2 for match in both)
    assert len({match.span for match in both[:3]}) == 3
    rejected = alone[0].span
    left = family_search.find_like(corpus, [first], 6, [rejected])
    assert all(match.span.overlap(rejected) <= 0.5 for match in left)
    assert any(match.span.overlap(rejected) > 0.5 for match in alone)


def shared(one, other):
    """Common time of two parts as a share of the time of either."""
    if one.recording != other.recording:
        return 0.0
    common = min(one.end, other.end) - max(one.start, other.start)
    return common / (max(one.end, other.end) - min(one.start, other.start))


def brute_force(apart):
    """Least mean cost and first frame of the match that ends at each frame, by recursion."""
    length, frames = apart.shape
    best = {}

    def cost(row, column):
        if row == 0:
            return (apart[0, column], column) if column >= 0 else (np.inf, 0)
        if row < 0 or column < 0:
            return np.inf, 0
        if (row, column) not in best:
            own = apart[row, column]
            ways = []
            for rows, columns in ((1, 1), (1, 2), (2, 1)):
                if row >= rows and column >= columns:
                    before, start = cost(row - rows, column - columns)
                    extra = apart[row - 1, column] if rows == 2 else 0.0
                    ways.append((before + own + extra, start))
            best[row, column] = min(ways, default=(np.inf, 0), key=lambda way: way[0])
        return best[row, column]

    return [cost(length - 1, column) for column in range(frames)]


@pytest.mark.parametrize("seed", range(5))
def test_matches_are_those_of_the_recursion(seed):
    apart = np.random.default_rng(seed).uniform(0.1, 1.0, (7, 40))
    apart[:, 20:22] = np.inf
    found = motion_features.match_ends(apart)
    expected = brute_force(apart)
    np.testing.assert_allclose(found.costs, [cost / 7 for cost, _ in expected], rtol=1e-12)
    finite = np.isfinite(found.costs)
    assert finite.any() and not finite.all()
    starts = [start for _, start in expected]
    assert found.starts[finite].tolist() == np.array(starts)[finite].tolist()
