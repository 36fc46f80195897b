"""Rows of the benchmark table from Table 1, and precomputation against GSTools."""

from collections.abc import Callable
from functools import partial

import gstools
from family import Family
from rows import Row
from timing import in_turn

from paper import poses, precomputation
from paper.measurement import CORE_GOAL, PRECOMPUTE_GOAL, SHOWN, Baseline, Size, Table1
from paper.variogram import ExperimentalVariogram, VariogramModel


def rows(table: Table1) -> list[Row]:
    """Return rows for precomputation, poses and compression."""
    before = f"precompute at {SHOWN}: {precomputation.OURS}"
    pose = f"pose at {SHOWN}, compiled: {poses.OURS}"
    return [
        *(_against(one, before, 1e3, "ms") for one in table.precompute),
        *(_against(one, pose, 1e6, "µs") for one in table.pose),
        *map(_compression, table.sizes),
    ]


def _against(one: Baseline, name: str, scale: float, unit: str) -> Row:
    return Row(name, scale * one.ours, unit, one.words, one.ratio, one.goal)


def _compression(size: Size) -> Row:
    r1, r2, r3 = size.ranks
    return Row(
        f"tensor within {size.threshold} of full rank, summed over joints and frames",
        float(r1 * r2 * r3),
        "numbers in the core",
        f"the raw tensor; all stored, {size.stored:.0f} times",
        size.core,
        CORE_GOAL if size.threshold.startswith("500 ") else None,
    )


def library_rows(trained_family: Family) -> list[Row]:
    """Return the row for precomputation against variograms fitted by GSTools."""
    runs: dict[str, Callable[[], object]] = {
        "ours": partial(precomputation.ours, trained_family, SHOWN),
        "naive": partial(precomputation.naive, trained_family, _fit_by_gstools),
    }
    timings = in_turn(runs, rounds=3, repeats=1)
    return [
        Row(
            f"precompute at {SHOWN}: {precomputation.OURS}",
            1e3 * timings["ours"],
            "ms",
            precomputation.NAIVE.format("GSTools"),
            timings["naive"] / timings["ours"],
            PRECOMPUTE_GOAL,
        )
    ]


def _fit_by_gstools(experimental: ExperimentalVariogram, _: str) -> VariogramModel:
    model = gstools.Matern(dim=4, nu=2.5)
    weights = experimental.pairs / experimental.values**2
    model.fit_variogram(
        experimental.distances, experimental.values, weights=weights, nu=False, max_eval=10_000
    )
    return VariogramModel(
        float(model.nugget), float(model.var), float(model.percentile_scale(0.95))
    )
