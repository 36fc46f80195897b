"""Tests of warps with a few knots: any parameters give a valid warp."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.interpolate import PchipInterpolator

from posefield_train.align.warp import FIT_TIMES, MINIMUM_INCREMENT, CanonicalTiming, WarpBasis

TOLERANCE = 1e-12
EVEN = np.ones(len(FIT_TIMES))
ANY_LOGS = st.integers(3, 24).flatmap(
    lambda knots: arrays(float, knots, elements=st.floats(-40.0, 40.0))
)


@pytest.fixture(params=[3, 6, 24], ids="{} knots".format)
def basis(request):
    return WarpBasis(request.param)


@pytest.fixture
def logs(basis, rng):
    return 0.5 * rng.normal(size=(20, basis.knots))


@settings(derandomize=True, database=None, max_examples=300, deadline=None)
@given(ANY_LOGS)
def test_any_logs_make_a_warp_of_the_unit_interval_onto_itself(logs):
    s = WarpBasis(len(logs)).evaluate(logs, FIT_TIMES)
    assert abs(s[0]) < TOLERANCE
    assert abs(s[-1] - 1.0) < TOLERANCE
    # Where increments of 1e-35 follow one another, a step is less than a rounding of s.
    assert np.diff(s).min() > -1e-15


@settings(derandomize=True, database=None, max_examples=100, deadline=None)
@given(st.integers(3, 24).flatmap(lambda k: arrays(float, k, elements=st.floats(-3.0, 3.0))))
def test_warp_of_moderate_logs_rises_everywhere(logs):
    assert np.diff(WarpBasis(len(logs)).evaluate(logs, FIT_TIMES)).min() > 0.0


def test_zeros_do_nothing(basis):
    assert np.max(np.abs(basis.evaluate(np.zeros(basis.knots), FIT_TIMES) - FIT_TIMES)) < TOLERANCE
    uneven = np.linspace(0.0, 0.1, basis.knots)
    assert np.max(np.abs(basis.evaluate(uneven, FIT_TIMES) - FIT_TIMES)) > 1e-3


def test_power_form_is_the_same_basis(basis):
    # The hinges of 24 knots are nearly alike: their solution loses four digits.
    found = basis.powers(FIT_TIMES) @ basis.power_form
    assert np.max(np.abs(found - basis.design(FIT_TIMES))) < 1e-8
    moved = basis.powers(np.minimum(FIT_TIMES + 1e-4, 1.0)) @ basis.power_form
    assert np.max(np.abs(moved - basis.design(FIT_TIMES))) > 1e-5


def test_inverse_leads_back(basis, logs):
    for own in logs:
        back = basis.evaluate(own, basis.invert(own, FIT_TIMES))
        # Straight lines between 501 points.
        assert np.max(np.abs(back - FIT_TIMES)) < 1e-4
        coarse = np.interp(FIT_TIMES, basis.evaluate(own, FIT_TIMES[::50]), FIT_TIMES[::50])
        assert np.max(np.abs(basis.evaluate(own, coarse) - FIT_TIMES)) > 1e-4


def jumps(warp, breaks, order):
    """Largest jump of a derivative at the breaks, by one-sided differences."""
    step = 1e-4 if order == 1 else 1e-3
    stencil = {1: [-1.0, 1.0], 2: [1.0, -2.0, 1.0]}[order]
    side = np.arange(order + 1) * step
    after = np.stack([warp(at + side) for at in breaks]) @ stencil
    before = np.stack([warp(at - side) for at in breaks]) @ stencil * (-1.0) ** order
    return np.max(np.abs(after - before)) / step**order


@pytest.mark.parametrize("knots", [4, 8])
def test_acceleration_is_continuous(knots, rng):
    basis = WarpBasis(knots)
    logs = 0.5 * rng.normal(size=knots)
    places = np.concatenate([[0.0], basis.breaks, [1.0]])
    pchip = PchipInterpolator(places, basis.evaluate(logs, places))

    def warp(u):
        return basis.evaluate(logs, u)

    # One-sided differences a step apart see the third derivative, which does jump, times the step.
    allowed = 0.1 * jumps(pchip, basis.breaks, 2)
    assert jumps(warp, basis.breaks, 2) < allowed
    assert jumps(pchip, basis.breaks, 1) < 0.05


def test_fit_recovers_the_increments_it_was_made_of(basis, logs):
    for own in logs:
        fitted = basis.fit(basis.evaluate(own, FIT_TIMES), EVEN)
        true = basis.increments(own)
        if np.any(true < MINIMUM_INCREMENT * basis.identity):
            continue
        assert np.max(np.abs(basis.increments(fitted) - true)) < 1e-9
        assert np.max(np.abs(basis.increments(np.zeros(basis.knots)) - true)) > 1e-3


def test_fit_never_freezes_a_pose(basis):
    frozen = np.clip(2.0 * FIT_TIMES - 0.5, 0.0, 1.0)
    fitted = basis.increments(basis.fit(frozen, EVEN))
    assert np.min(fitted / basis.identity) > 0.99 * MINIMUM_INCREMENT
    assert np.min(np.diff(basis.evaluate(basis.fit(frozen, EVEN), FIT_TIMES))) > 0.0
    if basis.knots > 4:
        assert np.min(fitted / basis.identity) < 1.01 * MINIMUM_INCREMENT


def test_fit_meets_what_weighs_more():
    basis, wanted = WarpBasis(6), np.clip(2.0 * FIT_TIMES - 0.5, 0.0, 1.0)
    weights = EVEN.copy()
    weights[150] = 1e5
    heavy = basis.evaluate(basis.fit(wanted, weights), FIT_TIMES)[150]
    light = basis.evaluate(basis.fit(wanted, EVEN), FIT_TIMES)[150]
    assert abs(heavy - wanted[150]) < 1e-3 < abs(light - wanted[150])


def test_stiffness_weighs_slopes_against_times(basis, logs):
    """By the normal equations, with a sum of one, where no increment is at its bound."""
    own, stiffness = 0.5 * logs[0], 0.1
    s, design = basis.evaluate(own, FIT_TIMES), basis.design(FIT_TIMES)
    slopes = np.diag(1.0 / basis.identity)
    weight = stiffness**2 * len(FIT_TIMES) / basis.knots
    matrix = np.zeros((basis.knots + 1, basis.knots + 1))
    matrix[:-1, :-1] = design.T @ design + weight * slopes @ slopes
    matrix[-1, :-1] = matrix[:-1, -1] = 1.0
    found = np.linalg.solve(matrix, [*(design.T @ s + weight * slopes.sum(axis=0)), 1.0])[:-1]
    fitted = basis.increments(basis.fit(s, EVEN, stiffness))
    assert np.max(np.abs(fitted - found)) < 1e-4 * np.max(found)
    assert np.max(np.abs(basis.increments(own) - found)) > 1e-2 * np.max(found)
    assert np.max(np.abs(basis.fit(s, EVEN, 1e3))) < 1e-4


def test_predicted_warps_are_the_identity_in_the_mean(basis, logs):
    """Of left-out predictions, which vary less than the warps that they are of."""
    timing = CanonicalTiming(basis, 60).unbiased(logs)
    means = (
        np.mean([basis.invert(own, FIT_TIMES) for own in warps], axis=0)
        for warps in (timing.warps(logs), logs)
    )
    corrected, plain = (np.max(np.abs(mean - FIT_TIMES)) for mean in means)
    # What the knots cannot follow is left.
    assert corrected < 0.004 and corrected < 0.3 * plain
