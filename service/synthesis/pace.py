"""What a pose of each level of detail costs, measured in the process that asks."""

import time
from collections.abc import Sequence

import numpy as np

from service.motion.conventions import Floats
from service.synthesis.ports import OUTPUTS
from service.synthesis.session import Session

BATCH = 512
"""Characters a call, each at one time, as a crowd asks."""
ROUNDS = 7
"""Few enough to be measured whenever a model is opened."""


def seconds_per_pose(session: Session) -> tuple[float, ...]:
    """Seconds that a pose takes at each level, in batches on one thread: the median of few rounds.

    They never grow from a level to the next: who could have the finer level for less is not asked
    for more.
    """
    return falling(in_turn([(session, level) for level in range(len(session.runtimes))], ROUNDS))


def in_turn(asked: Sequence[tuple[Session, int]], rounds: int) -> Floats:
    """Seconds (N,) a pose of levels of sessions, as they are found: the median of the rounds, whose
    number is odd.

    All are asked in every round: whatever slows the machine down slows all of them.
    """
    calls = [(session, _question(session), level) for session, level in asked]
    for call in calls:
        _ask(*call)
    taken = [[_ask(*call) for call in calls] for _ in range(rounds)]
    # np.median imports masked arrays when it is first called, which takes longer than all this.
    return np.sort(taken, axis=0)[rounds // 2] / BATCH


def falling(costs: Floats) -> tuple[float, ...]:
    """Costs (L,) of which none is above one before it."""
    return tuple(np.minimum.accumulate(costs).tolist())


def _question(session: Session) -> tuple[Floats, Floats, Floats]:
    """Controls (B, d) and times (B, 1), s, across what was sampled, and labels (B, p) of nobody."""
    card = session.card
    low, high = ([getattr(c, end) for c in card.controls] for end in ("minimum", "maximum"))
    times = np.linspace(0.0, card.durations[0], BATCH)[:, None]
    return np.linspace(low, high, BATCH), times, np.zeros((BATCH, len(card.performers)))


def _ask(session: Session, question: tuple[Floats, Floats, Floats], level: int) -> float:
    """Seconds of one call."""
    controls, times, labels = question
    start = time.perf_counter()
    session.run(controls, times, *OUTPUTS, labels=labels, level=level)
    return time.perf_counter() - start
