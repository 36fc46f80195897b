"""Errors of the answers that a reader of a table interpolates, measured at random points."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
import numpy.typing as npt

from posefield.answer_table import answer_gaps, samples
from posefield.answer_table.interpolated_answers import FRAMES, AnswerTable
from posefield.answer_table.samples import Queries
from posefield.common.units import Singles
from posefield.inference.session import Session
from posefield.kriging.support import Support, fit_support

POINTS = 250
"""Points of each level at which a table is measured."""
STORED = 50
"""Points of the table, of each level, at which its compression is measured."""


@dataclass(frozen=True)
class Accuracy:
    """Differences between interpolated answers and the model's.

    points: number of compared answers, half of them at controls within the sampled ranges. worst:
    largest distance of a joint in any frame within the ranges, m; beyond: the same outside them;
    stored: at points of the table, where only its compression tells. typical: median over the
    answers within of their largest distance, m. curves: largest difference of a curve within the
    ranges, as a share of the curve's. duration: largest difference, as a share. sigma: largest
    difference, m. support: share of the answers whose support differs.
    """

    points: int
    worst: float
    beyond: float
    stored: float
    typical: float
    curves: float
    duration: float
    sigma: float
    support: float


@dataclass(frozen=True)
class _Differences:
    """Of one level's answers (B,): in joints, m, in curves, as shares, and in what they are worth.

    outside: whether the controls lie outside the sampled ranges.
    """

    outside: Annotated[npt.NDArray[np.bool_], "points"]
    joints: Annotated[Singles, "points"]
    curves: Annotated[Singles, "points"]
    durations: Annotated[Singles, "points"]
    sigmas: Annotated[Singles, "points"]
    support: Annotated[npt.NDArray[np.bool_], "points"]


def measure(session: Session, own: AnswerTable, seed: int = 1) -> Accuracy:
    """Return the errors of a table at random points of all levels, over the whole grid.

    Frames between those of the table are compared too. seed: of the random points.
    """
    rng = np.random.default_rng(seed)
    levels, known = range(len(own.levels)), fit_support(np.array(session.card.examples))
    each = [vars(_differences(session, own, known, level, rng)) for level in levels]
    found = _Differences(**{name: np.concatenate([one[name] for one in each]) for name in each[0]})
    stored = max(_compression(session, own, level, rng) for level in levels)
    within = ~found.outside
    return Accuracy(
        points=len(found.joints),
        worst=float(found.joints[within].max()),
        beyond=float(found.joints[found.outside].max()),
        stored=stored,
        typical=float(np.median(found.joints[within])),
        curves=float(found.curves[within].max()),
        duration=float(found.durations.max()),
        sigma=float(found.sigmas.max()),
        support=float(found.support.mean()),
    )


def _differences(
    session: Session, own: AnswerTable, known: Support, level: int, rng: np.random.Generator
) -> _Differences:
    """Return the differences at random points, every second one within the sampled ranges.

    known: support of the captured clips.
    """
    card, bounds = session.card, session.bounds
    points = rng.uniform(*bounds.limits, (POINTS, len(bounds.low)))
    points[::2] = rng.uniform(bounds.low, bounds.high, points[::2].shape)
    asked = Queries(points, rng.integers(-1, len(samples.names(card)), POINTS), level)
    exact = samples.sample(session, asked, 2 * FRAMES - 1)
    found = own.interpolate(asked)
    between = card, answer_gaps.halved(found), exact
    return _Differences(
        bounds.outside(points),
        answer_gaps.gaps(*between),
        answer_gaps.curve_gaps(*between),
        np.abs(found.durations / exact.durations - 1.0),
        np.abs(found.sigmas - exact.sigmas),
        own.supported(points) != known.supported(points),
    )


def _compression(session: Session, own: AnswerTable, level: int, rng: np.random.Generator) -> float:
    """Return the largest distance of a joint at points of the table, m."""
    points = own.grid.points[rng.integers(0, len(own.grid), STORED)]
    who = rng.integers(-1, len(samples.names(session.card)), STORED)
    asked = Queries(points, who, level)
    exact = samples.sample(session, asked, FRAMES)
    return float(answer_gaps.gaps(session.card, own.interpolate(asked), exact).max())
