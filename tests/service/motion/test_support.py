"""Tests of the support flag: control ranges and kriging variance."""

import numpy as np
import pytest
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF

from posefield.kriging import support
from posefield.kriging.support import NUGGET, covariances
from posefield.synthesis import trust

CLOSE = 1e-9
WIDE = np.array([2.0, 30.0, 0.5])


@pytest.fixture
def controls(rng):
    """Controls (40, 3) of a family, in units of their own."""
    return np.array([1.0, -5.0, 0.0]) + WIDE * rng.random((40, 3))


@pytest.fixture
def own(controls):
    return support.fit_support(controls)


def test_the_variance_is_that_of_a_gaussian_process(own, controls, rng):
    points = np.array([1.0, -5.0, 0.0]) + WIDE * rng.uniform(-0.3, 1.3, (50, 3))
    assert np.allclose(own.variance(points), judged(own, controls, points), atol=CLOSE)
    # Negative control: with another scale it would not be.
    other = judged(own, controls, points, 1.01 * support.SCALE)
    assert not np.allclose(own.variance(points), other, atol=CLOSE)


def judged(own, controls, points, scale=support.SCALE):
    """Variance (B,) by scikit-learn."""
    ends = controls.min(axis=0), controls.max(axis=0)
    process = GaussianProcessRegressor(RBF(scale), alpha=support.NUGGET, optimizer=None)
    process.fit(support.half_ranges(controls, *ends), np.zeros(len(controls)))
    return process.predict(support.half_ranges(points, *ends), return_std=True)[1] ** 2


def test_left_out_each_sample_is_as_the_others_support_it(own, controls):
    for clip in range(len(controls)):
        others = support.Support(own.low, own.high, np.delete(own.samples, clip, axis=0))
        assert others.variance(controls[[clip]])[0] == pytest.approx(own.left_out[clip], abs=CLOSE)
    # Negative control: with itself among them it would be another.
    assert own.variance(controls[:1])[0] < 0.9 * own.left_out[0]


def test_one_is_told_as_many_are(own, rng):
    points = np.array([1.0, -5.0, 0.0]) + WIDE * rng.uniform(-0.3, 1.3, (5_000, 3))
    many = own.supported(points)
    assert many.tolist() == [own.is_supported(point) for point in points.tolist()]
    plainly = (own.beyond(points) <= support.RANGE_MARGIN).all(axis=1)
    assert np.array_equal(many, plainly & (own.variance(points) <= own.limit))
    assert set(many) == {True, False}


@pytest.mark.parametrize("controls_count", [1, 3])
def test_bounds_of_leading_directions_enclose_the_variance(controls, rng, controls_count):
    own = support.fit_support(controls[:, :controls_count])
    points = np.array([1.0, -5.0, 0.0]) + WIDE * rng.uniform(-0.3, 1.3, (5_000, 3))
    points = points[:, :controls_count]
    lowest, highest = own.variance_bounds(points)
    variance = own.variance(points)
    rounding = 0.01 * support.FLOAT32_ERROR
    assert (lowest - rounding <= variance).all()
    assert (variance <= highest + rounding).all()
    # They decide most questions.
    sure = (highest < own.limit) | (lowest > own.limit)
    assert sure.mean() > 0.9
    if controls_count == 1:
        # Negative control: without the rest that the other directions explain it would not.
        assert (highest > variance + rounding).any()


def test_on_the_edge_of_what_is_held_one_is_told_as_many_are(own, controls):
    """Even grids meet it, 0.1 of a range beyond."""
    sample, room = controls[own.variance(controls).argmin()], 0.3 * (own.high - own.low)
    even = np.linspace(own.low - room, own.high + room, 25)
    points = np.tile(sample, (3, 25, 1))
    for control in range(3):
        points[control, :, control] = even[:, control]
    points = points.reshape(-1, 3)
    many = own.supported(points)
    assert many.tolist() == [own.is_supported(point) for point in points.tolist()]
    # Negative control: told by shares, which are rounded otherwise, they would not be.
    assert (many & (own.beyond(points) > support.RANGE_MARGIN).any(axis=1)).any()


def test_what_lies_farther_beyond_a_control_than_a_tenth_of_its_range_is_not_held(own, controls):
    for control, width in enumerate(np.ptp(controls, axis=0)):
        for end, outward in ((own.high, 1.0), (own.low, -1.0)):
            # A sample that is the outermost already.
            sample = controls[np.argmin(np.abs(controls[:, control] - end[control]))].copy()
            sample[control] = end[control] + outward * 0.1001 * width
            assert not own.is_supported(sample.tolist())
            assert own.beyond(sample[None])[0, control] == pytest.approx(0.1001)
            sample[control] = end[control] + outward * 0.0999 * width
            assert (own.beyond(sample[None])[0] <= support.RANGE_MARGIN).all()


def test_far_away_is_no_overflow(own, controls):
    far = controls[:2] + 1e6 * WIDE
    assert own.supported(far).tolist() == [False, False]
    assert not own.is_supported(far[0].tolist())


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
    for at, found in trust.rank_candidates(candidates, samples, 8):
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
    found = trust.rank_candidates(candidates[:5], samples, 10)
    assert sorted(at for at, _ in found) == [0, 1, 2, 3, 4]
