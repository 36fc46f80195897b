"""Comparison of time warping with dtaidistance, which uses the classic three steps.

The costs differ: ours limits the slope and weights each step by its length. They agree where the
best path is the diagonal, and elsewhere dtaidistance's is a lower bound.
"""

import numpy as np
from dtaidistance import dtw_ndim

from posefield_train.align import dtw

TOLERANCE = 1e-9


def theirs(sequence, reference):
    """Sum of squared distances along the classic best path."""
    return dtw_ndim.distance(sequence, reference, use_c=False) ** 2


def first(sequence, reference):
    return np.sum(np.square(sequence[0] - reference[0]))


def test_costs_agree_where_the_best_path_is_the_diagonal(rng):
    ramp = np.linspace(0.0, 30.0, 25)[:, None] * np.ones(3)
    noisy = ramp + rng.uniform(-0.3, 0.3, size=ramp.shape)
    # Each diagonal step goes one way in both directions, and so counts twice; the start does not.
    found = dtw.total_cost(noisy[None], ramp)[0]
    assert abs(found - (2.0 * theirs(noisy, ramp) - first(noisy, ramp))) < TOLERANCE
    assert abs(found - theirs(noisy, ramp)) > 0.1


def test_classic_cost_bounds_the_limited_one_from_below(rng):
    walks = np.cumsum(rng.normal(size=(8, 25, 2)), axis=1)
    reference, near = walks[0], 0
    for sequence in walks[1:]:
        found = dtw.total_cost(sequence[None], reference)[0]
        start = first(sequence, reference)
        # The cheapest cell of ours is one of three in a step of four: it counts four thirds.
        least = start + 4.0 / 3.0 * (theirs(sequence, reference) - start)
        assert found >= least - TOLERANCE
        near += found < 4.0 * least
    assert near
