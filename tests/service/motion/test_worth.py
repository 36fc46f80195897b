"""What one more captured clip would be worth: against variances computed anew."""

import numpy as np
import pytest

from service.motion import field, worth
from service.motion.field import Hyper

CLOSE = 1e-7
FIELDS = [
    Hyper("gaussian", (0,), np.full(3, 0.5), 0.05),
    Hyper("matern52", (0, 1, 1), np.array([0.2, 0.5, 1.0]), 0.3),
]


@pytest.fixture(params=FIELDS, ids=["gaussian", "matern"])
def hyper(request):
    return request.param


@pytest.fixture
def samples(rng):
    return rng.uniform(-1.0, 1.0, (12, 3))


@pytest.fixture
def candidates(rng):
    return rng.uniform(-1.0, 1.0, (60, 3))


def variances(hyper, candidates, samples):
    """Variance (C,), from nothing but its definition: field and drift as one Gaussian process."""

    def covariances(a, b):
        basis = [field.drift(each, 3, max(hyper.drifts)) for each in (a, b)]
        return field.covariances(hyper, a, b) + worth.DRIFT**2 * basis[0] @ basis[1].T

    own = covariances(samples, samples) + hyper.nugget * np.eye(len(samples))
    near = covariances(hyper, candidates, samples)
    prior = np.diagonal(covariances(hyper, candidates, candidates))
    return prior - np.sum(near @ np.linalg.inv(own) * near, axis=1)


def test_each_is_worth_what_the_variance_falls_by_with_those_before_it(hyper, samples, candidates):
    known = samples
    for at, found in worth.rank(hyper, candidates, samples, 8):
        before = variances(hyper, candidates, known)
        known = np.vstack([known, candidates[at]])
        after = variances(hyper, candidates, known)
        assert found.variance == pytest.approx(before[at], abs=CLOSE)
        assert found.gain == pytest.approx(1.0 - after.mean() / before.mean(), abs=CLOSE)
        # Negative control: without what was taken before, it would be worth something else.
        if len(known) > len(samples) + 1:
            alone = variances(hyper, candidates, np.vstack([samples, candidates[at]])).mean()
            first = variances(hyper, candidates, samples).mean()
            assert abs(1.0 - alone / first - found.gain) > 1e-6


def test_none_is_ranked_twice_and_all_there_are_at_most(hyper, samples, candidates):
    found = worth.rank(hyper, candidates[:5], samples, 10)
    assert sorted(at for at, _ in found) == [0, 1, 2, 3, 4]


def test_what_is_far_from_all_that_was_captured_comes_first(hyper, samples):
    gap = np.array([[0.9, 0.9, 0.9]])
    known = samples[np.max(samples, axis=1) < 0.3]
    beside = known + 0.01
    (at, found), *_ = worth.rank(hyper, np.vstack([beside, gap]), known, 1)
    assert at == len(beside)
    assert found.variance > 3.0 * variances(hyper, beside, known).max()


def test_suggested_points_lower_the_variance_more_than_random_ones(rng, hyper, samples, candidates):
    chosen = [at for at, _ in worth.rank(hyper, candidates, samples, 10)]
    suggested = variances(hyper, candidates, np.vstack([samples, candidates[chosen]])).mean()
    for _ in range(20):
        some = candidates[rng.choice(len(candidates), 10, replace=False)]
        assert suggested < variances(hyper, candidates, np.vstack([samples, some])).mean()


def test_where_the_drift_is_all_the_variance_is_that_of_universal_kriging(rng, samples, candidates):
    """A drift that may be anything: the textbook's system, solved by itself."""
    hyper = FIELDS[1]
    one = Hyper(hyper.covariance, (1,), hyper.scales, hyper.nugget)
    basis = field.basis(one, candidates, samples)
    inverse = field.invert(one, samples, 1)
    expected = 1.0 - np.sum(basis @ inverse * basis, axis=1)
    assert worth.variances(one, candidates, samples) == pytest.approx(expected, rel=0.01)
    # Negative control: without the drift it is less.
    plain = Hyper(hyper.covariance, (0,), hyper.scales, hyper.nugget)
    assert worth.variances(plain, candidates, samples).mean() < 0.95 * expected.mean()
