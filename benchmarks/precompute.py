"""Precomputation at the paper's size, from aligned clips to everything a query needs."""

from functools import partial

import gstools
from rows import Row

from model_export.evaluate import table1_precompute as precompute
from model_export.evaluate.table1_family import Family
from model_export.evaluate.table1_measure import PRECOMPUTE_GOAL, SHOWN
from model_export.evaluate.table1_timing import in_turn
from model_export.variogram import Experimental, Fit


def rows(made: Family) -> list[Row]:
    """Ours against the naive method with its variograms fitted by a library."""
    runs = {
        "ours": partial(precompute.ours, made, SHOWN),
        "naive": partial(precompute.naive, made, _by_gstools),
    }
    taken = in_turn(runs, rounds=3, repeats=1)
    return [
        Row(
            f"precompute at {SHOWN}: {precompute.OURS}",
            1e3 * taken["ours"],
            "ms",
            precompute.NAIVE.format("GSTools"),
            taken["naive"] / taken["ours"],
            PRECOMPUTE_GOAL,
        )
    ]


def _by_gstools(experimental: Experimental, _: str) -> Fit:
    model = gstools.Matern(dim=4, nu=2.5)
    weights = experimental.pairs / experimental.values**2
    model.fit_variogram(
        experimental.distances, experimental.values, weights=weights, nu=False, max_eval=10_000
    )
    return Fit(float(model.nugget), float(model.var), float(model.percentile_scale(0.95)))
