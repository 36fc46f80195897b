"""Tests of Table 1: its error measure, its ranks, and its text with all definitions."""

from dataclasses import replace

import numpy as np
import pytest
from paper import errors, measurement

from posefield_train.graph import truncation_cost
from posefield_train.tensor import truncation_error

# Compiling the kernels and measuring takes longer than a unit test may.
pytestmark = pytest.mark.system


@pytest.fixture(scope="module")
def over(made):
    return errors.uniform(made, 30)


@pytest.fixture(scope="module")
def measured(made):
    return measurement.of(made, points=30, rounds=1)


def test_distances_are_summed_over_joints_and_frames():
    found, expected = np.zeros((2, 4, 5, 3)), np.zeros((2, 4, 5, 3))
    found[0] = [3.0, 4.0, 0.0]
    assert errors.between(found, expected) == pytest.approx(np.sqrt(100.0**2 / 2))
    assert errors.between(found, found) == 0.0


def test_at_the_samples_without_nugget_the_motions_are_the_clips(over, made, small_recipe):
    """With mean bones for all, as Table 1 has them."""
    at_samples = replace(over, points=made.samples, hyper=replace(over.hyper, nugget=0.0))
    judge = truncation_error.truncation_reference(small_recipe, made.examples, made.trained.tensor)
    bones = np.broadcast_to(made.offsets.mean(axis=0), made.offsets.shape)
    clips = truncation_error.positions(
        judge.tensor, judge.tensor.values, judge.parents, np.array(bones)
    )
    assert np.abs(at_samples.whole - clips).max() < 1e-6
    assert np.abs(replace(over, points=made.samples).whole - clips).max() > 1e-3


def test_smallest_tensor_keeps_the_threshold_and_is_not_wasteful(over, made):
    full, threshold = made.trained.full, 3.0
    found = errors.smallest(over, threshold)
    assert 0.8 * threshold < over.truncation(full.truncated(found)) <= threshold
    for mode in range(3):
        fewer = tuple(rank - 2 * (axis == mode) for axis, rank in enumerate(found))
        assert over.truncation(full.truncated(fewer)) > threshold


def test_every_size_says_what_it_costs(measured, made):
    named = {size.threshold: size for size in measured.sizes}
    assert set(named) == {
        *measurement.THRESHOLDS,
        *(f"the paper's {'×'.join(map(str, ranks))}" for ranks in measurement.PAPER_RANKS),
    }
    for asked, limit in measurement.THRESHOLDS.items():
        size = named[asked]
        assert size.error <= limit
        compression = truncation_cost.shape_compression(
            made.trained.tensor.values.shape, size.ranks, 4
        )
        assert (size.core, size.stored) == (compression.core, compression.stored)
    assert named["500 cm"].core < named["1000 cm"].core
    assert all(size.from_naive > 0.5 * measured.full_from_naive for size in measured.sizes)
