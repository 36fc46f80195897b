"""Benchmark of the levels of detail: seconds per pose on this machine."""

import time
from collections.abc import Sequence
from typing import Annotated

import numpy as np

from posefield.common.array_shapes import PointControls, PointLabels
from posefield.common.cancellation import ProgressCallback, ignore_progress
from posefield.common.units import Floats
from posefield.inference.graph_ports import OUTPUTS
from posefield.inference.session import Session

ROUNDS = 7
"""Rounds of the benchmark: few, as it runs whenever a model is opened."""
ROWS_PER_CALL = 512
"""Poses of the calls that are timed, as many as in the calls of a small crowd."""


def seconds_per_pose(
    session: Session, progress: ProgressCallback = ignore_progress
) -> tuple[float, ...]:
    """Return the seconds per pose of each level, in batches as of a crowd.

    Each is the median of the rounds. The costs never increase from a level to the next coarser one,
    since a finer level that is cheaper can be used instead.
    """
    levels = [(session, level) for level in range(len(session.card.levels))]
    return monotone_costs(benchmark_levels(levels, ROUNDS, progress))


def benchmark_levels(
    asked: Sequence[tuple[Session, int]],
    rounds: int,
    progress: ProgressCallback = ignore_progress,
) -> Annotated[Floats, "{len(asked)}"]:
    """Return the seconds per pose (N,) of levels of sessions: the median of the rounds.

    rounds: an odd number. Every round measures each level once, so that a slowdown of the machine
    affects all of them. progress: called after each round, and after the one that warms up.
    """
    calls = [(session, _sample_inputs(session), level) for session, level in asked]
    taken = []
    for done in range(rounds + 1):
        taken.append([_time_call(*call) for call in calls])
        progress(done + 1, rounds + 1)
    # np.median imports masked arrays on first use, which takes longer than this measurement.
    return np.sort(taken[1:], axis=0)[rounds // 2] / ROWS_PER_CALL


def monotone_costs(costs: Annotated[Floats, "levels"]) -> tuple[float, ...]:
    """Return the costs (L,), each lowered to the minimum of itself and those before it."""
    return tuple(np.minimum.accumulate(costs).tolist())


def _sample_inputs(
    session: Session,
) -> tuple[PointControls, Annotated[Floats, "points 1"], PointLabels]:
    """Return controls (B, d) and times (B, 1), s, across the ranges, and zero labels (B, p)."""
    card, rows = session.card, ROWS_PER_CALL
    low, high = ([getattr(c, end) for c in card.controls] for end in ("minimum", "maximum"))
    times = np.linspace(0.0, card.durations[0], rows)[:, None]
    return np.linspace(low, high, rows), times, np.zeros((rows, sum(card.label_counts)))


def _time_call(session: Session, question: tuple[Floats, Floats, Floats], level: int) -> float:
    """Return the seconds of one call."""
    controls, times, labels = question
    start = time.perf_counter()
    session.run(controls, times, *OUTPUTS, labels=labels, level=level)
    return time.perf_counter() - start
