"""Feet of a walking crowd: what standing costs, and how much less they slide.

Processor time of all threads, since a crowd may use them all.
"""

import time

import numpy as np
from rows import Row

from posefield.locomotion import walking_crowd
from posefield.locomotion.gait import Gait
from posefield.motion.clip import Motions
from posefield.question.walk_question import WalkQuestion
from posefield.synthesis import walking_feet
from posefield.synthesis.synthesizer import Synthesizer

COUNT, SECONDS, RATE = 500, 3.3, 30.0
"""100 frames each."""
GOAL, SLIDING = 1.5, 8.0
ROUNDS = 3


def rows(walks: dict[str, Gait]) -> list[Row]:
    """Processor seconds of a crowd with feet that stand, and the speed at which they slide."""
    return [row for name, gait in walks.items() for row in _walk_rows(name, gait)]


def _walk_rows(name: str, gait: Gait) -> list[Row]:
    timings = {"as_predicted": np.inf, "stand": np.inf}
    skates = {}
    for mode in ("as_predicted", "stand") * ROUNDS:
        start = time.process_time()
        motions = _motions(gait, mode)
        timings[mode] = min(timings[mode], time.process_time() - start)
        skates[mode] = _skate(gait, motions)
    title = f"{name}, {COUNT} characters of 100 frames, feet that stand"
    ratio = timings["stand"] / timings["as_predicted"]
    cost = f"processor time; as predicted: {timings['as_predicted']:.3g} s, {ratio:.2g} times less"
    slid = f"as predicted: {skates['as_predicted']:.3g} cm/s"
    return [
        Row(title, timings["stand"], "s", cost, None, GOAL),
        Row(f"{title}: skate", skates["stand"], "cm/s", slid, None, SLIDING),
    ]


def _motions(gait: Gait, feet: str) -> list[Motions]:
    order = WalkQuestion(count=COUNT, seconds=SECONDS, fps=RATE, feet=feet)
    model = Synthesizer("walk", gait.session)
    return list(walking_feet.build_crowd(model, gait, order).batches)


def _skate(gait: Gait, motions: list[Motions]) -> float:
    card = gait.session.card
    speeds = [walking_crowd.measure_foot_skate(card, one, RATE).ravel() for one in motions]
    return 100.0 * float(np.concatenate(speeds).mean())
