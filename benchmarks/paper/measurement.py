"""Measurement of Table 1: compression, precomputation and time per pose.

The data are the procedural family, which has the size of the paper's data. The error measure is the
paper's: joint distances summed over joints and frames, root mean square over control points.
"""

import tempfile
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import family
from family import Family
from timing import in_turn

from paper import errors, poses, precomputation
from paper.errors import Errors
from paper.naive_kriging import NaiveKriging
from posefield.common.units import Floats
from posefield_train.graph import truncation_cost
from posefield_train.graph.truncation_cost import RankTriple

# The paper states no unit for its thresholds: summed distances in m, under two assumptions.
THRESHOLDS = {"500 cm": 5.0, "750 cm": 7.5, "1000 cm": 10.0, "500 mm": 0.5}
PAPER_RANKS: tuple[RankTriple, ...] = ((22, 6, 24), (18, 6, 28), (20, 6, 20))
# Every naive form is compared with posefield at the first size in the paper.
SHOWN = PAPER_RANKS[0]
SEARCHED = "SciPy's least_squares"
CORE_GOAL, PRECOMPUTE_GOAL = 267.0, 20.0
POINTS, POSES = 2_000, 2_000


@dataclass(frozen=True)
class Size:
    """Costs and errors of a core of given ranks.

    threshold: or source of the ranks. error: summed distance, m, from full rank with the same
    weights; from_naive: from naive kriging. core, stored: numbers of the raw tensor over those of
    the core, and over all numbers stored. precompute, pose: seconds.
    """

    threshold: str
    ranks: RankTriple
    error: float
    from_naive: float
    core: float
    stored: float
    precompute: float
    pose: float


@dataclass(frozen=True)
class Baseline:
    """A form of the naive method: its definition and seconds, posefield's seconds, goal."""

    name: str
    words: str
    seconds: float
    ours: float
    goal: float | None

    @property
    def ratio(self) -> float:
        """Seconds of the naive form over those of posefield."""
        return self.seconds / self.ours


@dataclass(frozen=True)
class Table1:
    """The table. raw: size (D, T, N) of the tensor. full_from_naive: summed distance, m, of full
    rank from naive kriging; no truncation is nearer."""

    raw: tuple[int, int, int]
    joints: int
    points: int
    full_from_naive: float
    sizes: tuple[Size, ...]
    precompute: tuple[Baseline, ...]
    pose: tuple[Baseline, ...]


def measure(points: int = POINTS) -> Table1:
    """Measure the table on the procedural family, in a few minutes."""
    with tempfile.TemporaryDirectory() as folder:
        return of(family.make(Path(folder) / "reaching"), points, rounds=7)


def of(trained_family: Family, points: int, rounds: int) -> Table1:
    """Measure the table on a family, with medians of `rounds` timings."""
    over = errors.uniform(trained_family, points)
    ranks_by_name = _asked(over)
    field = precomputation.naive(trained_family, precomputation.FITS[SEARCHED])
    before = _precompute_times(trained_family, ranks_by_name, rounds)
    single = _pose_times(trained_family, ranks_by_name, field, rounds)
    from_naive = over.positions(over.of_naive(field))
    sizes = tuple(
        _size(over, from_naive, name, ranks, before[name], single[name])
        for name, ranks in ranks_by_name.items()
    )
    chosen = next(name for name, ranks in ranks_by_name.items() if ranks == SHOWN)
    return Table1(
        trained_family.trained.tensor.values.shape,
        len(trained_family.parents),
        points,
        errors.between(over.whole, from_naive),
        sizes,
        tuple(
            Baseline(
                fit, precomputation.NAIVE.format(fit), before[fit], before[chosen], PRECOMPUTE_GOAL
            )
            for fit in precomputation.FITS
        ),
        tuple(
            Baseline(form, words, single[form], single[chosen], poses.GOALS.get(form))
            for form, words in poses.FORMS.items()
        ),
    )


def _asked(over: Errors) -> dict[str, RankTriple]:
    """Return the ranks for each threshold, and those in the paper."""
    ranks_by_name = {name: errors.smallest(over, metres) for name, metres in THRESHOLDS.items()}
    return ranks_by_name | {f"the paper's {_times(ranks)}": ranks for ranks in PAPER_RANKS}


def _precompute_times(
    trained_family: Family, ranks_by_name: dict[str, RankTriple], rounds: int
) -> dict[str, float]:
    runs = {
        name: partial(precomputation.ours, trained_family, ranks)
        for name, ranks in ranks_by_name.items()
    }
    naive = {
        name: partial(precomputation.naive, trained_family, fit)
        for name, fit in precomputation.FITS.items()
    }
    return in_turn({**runs, **naive}, rounds, repeats=1)


def _pose_times(
    trained_family: Family, ranks_by_name: dict[str, RankTriple], field: NaiveKriging, rounds: int
) -> dict[str, float]:
    """Return seconds per pose of compiled code that computes poses one at a time."""
    question = poses.questions(trained_family, POSES)
    ours = {
        name: poses.ours(trained_family, *precomputation.ours(trained_family, ranks), question)
        for name, ranks in ranks_by_name.items()
    }
    timings = in_turn({**ours, **poses.naive(field, question)}, rounds, repeats=3)
    return {name: seconds / POSES for name, seconds in timings.items()}


def _size(
    over: Errors, from_naive: Floats, name: str, ranks: RankTriple, before: float, single: float
) -> Size:
    trained = over.trained_family.trained
    positions = over.positions(over.of(trained.full.truncated(ranks)))
    compression = truncation_cost.shape_compression(
        trained.tensor.values.shape, ranks, over.trained_family.samples.shape[1]
    )
    return Size(
        name,
        ranks,
        errors.between(positions, over.whole),
        errors.between(positions, from_naive),
        compression.core,
        compression.stored,
        before,
        single,
    )


def _times(ranks: RankTriple) -> str:
    return "×".join(map(str, ranks))
