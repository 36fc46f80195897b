"""Tests of typical clips and of the surroundings of captured clips."""

import numpy as np
import pytest

from posefield.kriging import typical_clip


@pytest.fixture
def clusters(rng):
    """Places of sixty clips in two clusters, of forty and of twenty."""
    near = rng.normal((0.0, 0.0), 0.1, (40, 2))
    return np.vstack([near, rng.normal((3.0, 1.0), 0.1, (20, 2))])


def test_the_medoid_has_the_least_sum_of_distances(rng):
    places = rng.normal(size=(30, 3))
    totals = [sum(np.linalg.norm(own - other) for other in places) for own in places]
    assert typical_clip.medoid(places) == int(np.argmin(totals))
    # Negative control: the clip nearest to the mean is another one of a skewed family.
    skewed = np.exp(3.0 * places)
    nearest = int(np.argmin(np.linalg.norm(skewed - skewed.mean(axis=0), axis=1)))
    assert typical_clip.medoid(skewed) != nearest


def test_of_two_clusters_the_medoid_lies_in_the_larger_one(clusters):
    assert typical_clip.medoid(clusters) < 40
    mean = clusters.mean(axis=0)
    assert np.linalg.norm(clusters - mean, axis=1).min() > 0.5, (
        "negative control: the mean is in none"
    )


def test_costs_choose_the_clips_that_count(clusters):
    costs = np.where(np.arange(60) < 40, 50.0, 0.0)
    assert typical_clip.typical_row(clusters, costs) >= 40
    # One clip far nearer than all others is the only candidate, wherever it lies.
    costs[7] = -30.0
    assert typical_clip.typical_row(clusters, costs) == 7


def test_a_neighbourhood_holds_the_clips_and_not_the_gap(clusters):
    around = typical_clip.neighbourhood(clusters)
    assert all(around.contains(own) for own in clusters)
    middle = 0.5 * (clusters[0] + clusters[50])
    assert not around.contains(middle)


def test_a_point_in_the_gap_is_pulled_in_to_its_own_cluster(clusters):
    around = typical_clip.neighbourhood(clusters)
    start, end = clusters[0], 0.6 * clusters[50]
    found = around.pull_in(start, end)
    assert around.contains(found) and not around.contains(found + 1e-3 * (end - start))
    assert np.linalg.norm(found - clusters[:40], axis=1).min() < 0.3
    inside = clusters[0] + 1e-3
    assert around.pull_in(start, inside) is inside
