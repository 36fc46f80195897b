"""Precomputation at the paper's size, from aligned clips to everything a query needs."""

import numpy as np
from family import Family
from rows import Row, in_turn

from model_export import align, hosvd, kriging, naive, tensor, tune, variogram

SIZE = "92 clips × 100 frames × 94 degrees of freedom"


def rows(made: Family) -> list[Row]:
    """Ours against the naive method, with the variogram fitted in two ways."""
    taken = in_turn(
        {
            "ours": lambda: _ours(made),
            "search": lambda: _naive(made, variogram.fit_by_search),
            "grid": lambda: _naive(made, variogram.fit),
        },
        rounds=7,
        repeats=1,
    )
    against = (
        "naive kriging: kinematics of all frames, then for each of 100 frames the dissimilarity "
        "of all pairs of poses, an experimental variogram, its fit by "
    )
    return [
        Row(
            f"precompute, {SIZE}: metric, tensor, HOSVD, one variogram, one system",
            1e3 * taken["ours"],
            "ms",
            against + "SciPy's least_squares, and a kriging system",
            taken["search"] / taken["ours"],
            20.0,
        ),
        Row(
            "the same",
            1e3 * taken["ours"],
            "ms",
            against + "our own linearised grid search, and a kriging system",
            taken["grid"] / taken["ours"],
            None,
        ),
    ]


def _ours(made: Family) -> kriging.Kriging:
    points = made.trained.model.bank.pose.samples
    weights = np.ones(len(made.parents))
    chart = made.trained.tensor.chart
    own = tensor.whitened(made.vectors, chart, made.parents, made.offsets, weights)
    full = hosvd.decompose(own.values)
    motions = full.bases[2] * np.linalg.norm(hosvd.unfold(full.core, 2), axis=1)
    return kriging.solve(tune.first_guess(points, motions, "matern52", 1), points, full.bases[2])


def _naive(made: Family, fitter: naive.Fitter) -> naive.Naive:
    positions = align.positions(made.trained.aligned, made.parents, made.offsets)
    points = made.trained.model.bank.pose.samples
    return naive.fit(points, positions, made.numbers, "matern52", fitter)
