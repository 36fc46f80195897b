"""Table 1 of the paper, measured again: compression, precomputation and time per pose.

Mukai & Kuriyama, Multilinear Motion Synthesis Using Geostatistics (SCA 2006). The data are the
procedural family, of the paper's size; the error is the paper's, the root mean square over control
points of joint distances summed over joints and frames.
"""

import tempfile
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from model_export import cost
from model_export.evaluate import table1_errors as errors
from model_export.evaluate import table1_family as family
from model_export.evaluate import table1_pose as pose
from model_export.evaluate import table1_precompute as precompute
from model_export.evaluate.table1_errors import Errors
from model_export.evaluate.table1_family import Family
from model_export.evaluate.table1_timing import in_turn
from model_export.naive import Naive
from model_export.ranks import Triple
from service.motion.conventions import Floats

# The paper gives its thresholds no unit. Summed distances in m, in two readings.
THRESHOLDS = {"500 cm": 5.0, "750 cm": 7.5, "1000 cm": 10.0, "500 mm": 0.5}
PAPER_RANKS: tuple[Triple, ...] = ((22, 6, 24), (18, 6, 28), (20, 6, 20))
# What every naive form is compared with: ours at the paper's first size.
SHOWN = PAPER_RANKS[0]
SEARCHED = "SciPy's least_squares"
CORE_GOAL, PRECOMPUTE_GOAL = 267.0, 20.0
POINTS, POSES = 2_000, 2_000


@dataclass(frozen=True)
class Size:
    """A tensor, what asked for it, and what it costs.

    error: summed distance, m, from full rank kriged by the same weights; from_naive: from naive
    kriging. core, stored: numbers of the raw tensor over those of the core and of all that is
    stored. precompute and pose in seconds.
    """

    asked: str
    ranks: Triple
    error: float
    from_naive: float
    core: float
    stored: float
    precompute: float
    pose: float


@dataclass(frozen=True)
class Baseline:
    """A naive form: what it is, its seconds and ours, and the ratio aimed at."""

    name: str
    words: str
    seconds: float
    ours: float
    goal: float | None

    @property
    def ratio(self) -> float:
        """How many times as long the naive form takes."""
        return self.seconds / self.ours


@dataclass(frozen=True)
class Table1:
    """The table: raw tensor (D, T, N), joints and control points; full_from_naive: summed distance,
    m, of the full rank from naive kriging, below which no truncation comes."""

    raw: tuple[int, int, int]
    joints: int
    points: int
    full_from_naive: float
    sizes: tuple[Size, ...]
    precompute: tuple[Baseline, ...]
    pose: tuple[Baseline, ...]


def measure(points: int = POINTS) -> Table1:
    """Table 1 of the procedural family, in a minute or two."""
    with tempfile.TemporaryDirectory() as folder:
        return of(family.make(Path(folder) / "reaching"), points, rounds=7)


def of(made: Family, points: int, rounds: int) -> Table1:
    """Table 1 of a family over so many control points; medians of so many rounds."""
    over = errors.uniform(made, points)
    asked = _asked(over)
    field = precompute.naive(made, precompute.FITS[SEARCHED])
    before = _precompute_times(made, asked, rounds)
    single = _pose_times(made, asked, field, rounds)
    from_naive = over.positions(over.of_naive(field))
    sizes = tuple(
        _size(over, from_naive, name, ranks, before[name], single[name])
        for name, ranks in asked.items()
    )
    shown = next(name for name, ranks in asked.items() if ranks == SHOWN)
    return Table1(
        made.trained.tensor.values.shape,
        len(made.parents),
        points,
        errors.between(over.whole, from_naive),
        sizes,
        tuple(
            Baseline(fit, precompute.NAIVE.format(fit), before[fit], before[shown], PRECOMPUTE_GOAL)
            for fit in precompute.FITS
        ),
        tuple(
            Baseline(form, words, single[form], single[shown], pose.GOALS.get(form))
            for form, words in pose.FORMS.items()
        ),
    )


def _asked(over: Errors) -> dict[str, Triple]:
    """Ranks by what asks for them: thresholds, and the paper's own."""
    found = {name: errors.smallest(over, metres) for name, metres in THRESHOLDS.items()}
    return found | {f"the paper's {_times(ranks)}": ranks for ranks in PAPER_RANKS}


def _precompute_times(made: Family, asked: dict[str, Triple], rounds: int) -> dict[str, float]:
    runs = {name: partial(precompute.ours, made, ranks) for name, ranks in asked.items()}
    naive = {name: partial(precompute.naive, made, fit) for name, fit in precompute.FITS.items()}
    return in_turn({**runs, **naive}, rounds, repeats=1)


def _pose_times(
    made: Family, asked: dict[str, Triple], field: Naive, rounds: int
) -> dict[str, float]:
    """Seconds of one pose, of many computed one by one in compiled code."""
    question = pose.asked(made, POSES)
    ours = {
        name: pose.ours(made, *precompute.ours(made, ranks), question)
        for name, ranks in asked.items()
    }
    taken = in_turn({**ours, **pose.naive(field, question)}, rounds, repeats=3)
    return {name: seconds / POSES for name, seconds in taken.items()}


def _size(
    over: Errors, from_naive: Floats, name: str, ranks: Triple, before: float, single: float
) -> Size:
    own = over.made.trained
    found = over.positions(over.of(own.full.truncated(ranks)))
    compression = cost.compression(own.tensor, ranks, over.made.samples.shape[1])
    return Size(
        name,
        ranks,
        errors.between(found, over.whole),
        errors.between(found, from_naive),
        compression.core,
        compression.stored,
        before,
        single,
    )


def _times(ranks: Triple) -> str:
    return "×".join(map(str, ranks))
