"""Errors of the answers that a reader of a table interpolates, measured at random points."""

from dataclasses import dataclass

import numpy as np

from posefield.answer_table import answer_gaps, samples
from posefield.answer_table.interpolated_answers import FRAMES, AnswerTable
from posefield.answer_table.samples import Queries
from posefield.inference.session import Session
from posefield.kriging.support import fit_support

POINTS = 250
"""Points of each level at which a table is measured."""


@dataclass(frozen=True)
class Accuracy:
    """Differences between interpolated answers and the model's.

    points: number of compared answers, half of them at controls within the sampled ranges. worst:
    largest distance of a joint in any frame within the ranges, m, and of a curve in metres that
    count as much; beyond: the same outside them.
    typical: median over the answers within of their largest distance, m. duration: largest
    difference, as a share. sigma: largest difference, m. support: share of the answers whose
    support differs.
    """

    points: int
    worst: float
    beyond: float
    typical: float
    duration: float
    sigma: float
    support: float


def measure(session: Session, own: AnswerTable, seed: int = 1) -> Accuracy:
    """Return the errors of a table at random points of all levels, over the whole grid.

    Frames between those of the table are compared too. seed: of the random points.
    """
    rng = np.random.default_rng(seed)
    card, bounds = session.card, session.bounds
    low, high = bounds.limits
    known = fit_support(np.array(card.examples))
    apart, outside, durations, sigmas, support = [], [], [], [], []
    for level in range(len(own.levels)):
        points = rng.uniform(low, high, (POINTS, len(low)))
        points[::2] = rng.uniform(bounds.low, bounds.high, points[::2].shape)
        who = rng.integers(-1, len(samples.names(card)), POINTS)
        asked = Queries(points, who, level)
        exact = samples.sample(session, asked, 2 * FRAMES - 1)
        found = own.interpolate(asked)
        gaps = answer_gaps.gaps(card, answer_gaps.halved(found), exact)
        apart.append(gaps.max(axis=(1, 2)))
        outside.append(bounds.outside(points))
        durations.append(np.abs(found.durations / exact.durations - 1.0))
        sigmas.append(np.abs(found.sigmas - exact.sigmas))
        support.append(own.supported(points) != known.supported(points))
    most, beyond = np.concatenate(apart), np.concatenate(outside)
    return Accuracy(
        len(own.levels) * POINTS,
        float(np.max(most[~beyond])),
        float(np.max(most[beyond])),
        float(np.median(most[~beyond])),
        float(np.max(durations)),
        float(np.max(sigmas)),
        float(np.mean(support)),
    )
