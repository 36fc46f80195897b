"""Precomputation at the paper's size, from aligned clips to everything a query needs."""

from functools import partial

import gstools
import numpy as np
from family import Family
from rows import Row, in_turn

from model_export import align, hosvd, kriging, naive, tensor, tune, variogram
from model_export.variogram import Experimental, Fit

SIZE = "92 clips × 100 frames × 94 degrees of freedom"


def rows(made: Family) -> list[Row]:
    """Ours against the naive method, with its variograms fitted in three ways."""
    taken = in_turn(
        {
            "ours": lambda: _ours(made),
            **{words: partial(_naive, made, fitter) for words, fitter in FITS.items()},
        },
        rounds=7,
        repeats=1,
    )
    return [
        Row(
            f"precompute, {SIZE}: metric, tensor, HOSVD, one variogram, one system",
            1e3 * taken["ours"],
            "ms",
            "naive kriging: kinematics of all frames, then for each of 100 frames the "
            "dissimilarity of all pairs of poses, an experimental variogram, its fit by "
            f"{words}, and a kriging system",
            taken[words] / taken["ours"],
            20.0,
        )
        for words in FITS
    ]


def _by_gstools(experimental: Experimental, _: str) -> Fit:
    model = gstools.Matern(dim=4, nu=2.5)
    weights = experimental.pairs / experimental.values**2
    model.fit_variogram(
        experimental.distances, experimental.values, weights=weights, nu=False, max_eval=10_000
    )
    return Fit(float(model.nugget), float(model.var), float(model.percentile_scale(0.95)))


FITS: dict[str, naive.Fitter] = {
    "GSTools": _by_gstools,
    "SciPy's least_squares": variogram.fit_by_search,
    "our own linearised grid search": variogram.fit,
}


def _ours(made: Family) -> kriging.Kriging:
    points = made.trained.model.bank.pose.samples
    weights = np.ones(len(made.parents))
    chart = made.trained.tensor.chart
    own = tensor.build(made.vectors, chart, made.parents, made.offsets, weights)
    full = hosvd.decompose(own.values)
    motions = full.bases[2] * np.linalg.norm(hosvd.unfold(full.core, 2), axis=1)
    return kriging.solve(tune.first_guess(points, motions, "matern52", 1), points, full.bases[2])


def _naive(made: Family, fitter: naive.Fitter) -> naive.Naive:
    positions = align.positions(made.trained.aligned, made.parents, made.offsets)
    points = made.trained.model.bank.pose.samples
    return naive.fit(points, positions, made.numbers, "matern52", fitter)
