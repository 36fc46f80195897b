"""Tests of the experimental variogram and its fits."""

import numpy as np
import pytest
from paper import variogram
from paper.variogram import (
    FEWEST_PAIRS,
    LAGS,
    LARGEST_LAG,
    RANGES,
    ExperimentalVariogram,
)

from posefield_train.kriging.kriging_graph import COVARIANCES
from posefield_train.tensor import hosvd

TOLERANCE = 1e-9


@pytest.fixture
def samples(rng):
    return rng.uniform(-1.0, 1.0, size=(40, 3))


@pytest.fixture
def values(samples, rng):
    return np.sin(samples @ rng.normal(size=(3, 5))) + 0.1 * rng.normal(size=(40, 5))


def model(covariance, nugget, sill, reach, distances):
    return nugget + sill * (1.0 - COVARIANCES[covariance].numpy(np.square(distances / reach)))


def seen(values, distances=None, pairs=None):
    distances = np.linspace(0.1, 2.0, len(values)) if distances is None else distances
    return ExperimentalVariogram(
        distances, values, np.full(len(values), 30.0) if pairs is None else pairs
    )


def test_lags_hold_the_pairs_of_their_distance(samples, values):
    found = variogram.experimental_variogram(samples, values)
    gaps = np.linalg.norm(samples[:, None] - samples, axis=-1)
    width = LARGEST_LAG * gaps.max() / LAGS
    expected = []
    for lag in range(LAGS):
        pairs = [
            (gaps[i, j], 0.5 * np.sum((values[i] - values[j]) ** 2))
            for i in range(40)
            for j in range(i)
            if lag * width < gaps[i, j] <= (lag + 1) * width
        ]
        if len(pairs) >= FEWEST_PAIRS:
            expected.append([*np.mean(pairs, axis=0), len(pairs)])
    rows = np.stack([found.distances, found.values, found.pairs], axis=1)
    assert np.max(np.abs(rows - expected)) < TOLERANCE
    assert np.max(np.abs(rows[1:, 1] - np.array(expected)[:-1, 1])) > 1e-2


def test_dissimilarity_is_the_distance_of_slices_of_the_core_tensor(samples, rng):
    tensor = rng.normal(size=(6, 5, 40))
    full = hosvd.decompose(tensor)
    slices = hosvd.mode_dot(full.core, full.bases[2], 2).reshape(-1, 40).T
    rows = full.bases[2] * np.linalg.norm(hosvd.unfold(full.core, 2), axis=1)
    by_slices = variogram.experimental_variogram(samples, slices).values
    assert (
        np.max(np.abs(variogram.experimental_variogram(samples, rows).values - by_slices))
        < TOLERANCE
    )
    plain = variogram.experimental_variogram(samples, full.bases[2]).values
    assert np.max(np.abs(plain - by_slices)) > 1.0


@pytest.mark.parametrize("degree", [0, 1])
def test_residuals_hold_nothing_of_the_drift(degree, samples, values):
    left = variogram.residuals(samples, values, degree)
    assert np.max(np.abs(left.sum(axis=0))) < TOLERANCE
    slopes = np.max(np.abs(samples.T @ left))
    assert slopes < TOLERANCE if degree else slopes > 1.0


@pytest.mark.parametrize("covariance", COVARIANCES)
@pytest.mark.parametrize("reach", RANGES[[12, 25]])
def test_fit_finds_the_model_that_was_put_in(covariance, reach):
    distances = np.linspace(0.05, 2.0, 15)
    found = variogram.fit_by_grid(
        seen(model(covariance, 0.3, 2.0, reach, distances), distances), covariance
    )
    assert found.range == reach
    assert abs(found.nugget - 0.3) < 1e-8
    assert abs(found.sill - 2.0) < 1e-8
    other = "exponential" if covariance == "gaussian" else "gaussian"
    assert (
        abs(
            variogram.fit_by_grid(
                seen(model(other, 0.3, 2.0, reach, distances), distances), covariance
            ).nugget
            - 0.3
        )
        > 1e-3
    )
