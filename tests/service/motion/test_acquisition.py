"""Tests of the expected variance reduction against recomputed variances."""

import numpy as np
import pytest

from posefield.kriging import acquisition
from posefield.kriging.support import NUGGET, covariances

CLOSE = 1e-9


@pytest.fixture
def samples(rng):
    return rng.uniform(-1.0, 1.0, (12, 3))


@pytest.fixture
def candidates(rng):
    return rng.uniform(-1.0, 1.0, (60, 3))


def variances(candidates, samples):
    """Variance (C,) of the plain field, from nothing but its definition."""
    own = covariances(samples, samples) + NUGGET * np.eye(len(samples))
    near = covariances(candidates, samples)
    return 1.0 - np.sum(near @ np.linalg.inv(own) * near, axis=1)


def test_each_is_worth_what_the_variance_falls_by_with_those_before_it(samples, candidates):
    known = samples
    for at, found in acquisition.rank_candidates(candidates, samples, 8):
        before = variances(candidates, known)
        known = np.vstack([known, candidates[at]])
        after = variances(candidates, known)
        assert found.variance == pytest.approx(before[at], abs=CLOSE)
        assert found.gain == pytest.approx(1.0 - after.mean() / before.mean(), abs=CLOSE)
        # Negative control: without what was taken before, it would be worth something else.
        if len(known) > len(samples) + 1:
            alone = variances(candidates, np.vstack([samples, candidates[at]])).mean()
            first = variances(candidates, samples).mean()
            assert abs(1.0 - alone / first - found.gain) > 1e-6


def test_none_is_ranked_twice_and_all_there_are_at_most(samples, candidates):
    found = acquisition.rank_candidates(candidates[:5], samples, 10)
    assert sorted(at for at, _ in found) == [0, 1, 2, 3, 4]
