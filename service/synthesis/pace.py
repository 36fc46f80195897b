"""What a pose costs at each level of detail, on this machine."""

import time

import numpy as np

from service.motion.conventions import Floats
from service.synthesis.session import Session

BATCH, TIMES = 512, 5


def seconds_per_pose(session: Session) -> tuple[float, ...]:
    """Seconds (L,) a pose in batches, of each level; they never grow from a level to the next."""
    controls = np.tile([[control.default for control in session.card.controls]], (BATCH, 1))
    return tuple(
        np.minimum.accumulate(
            [_seconds(session, controls, level) for level in range(len(session.card.levels))]
        ).tolist()
    )


def _seconds(session: Session, controls: Floats, level: int) -> float:
    taken = []
    for _ in range(TIMES):
        begun = time.perf_counter()
        session.run(controls, np.zeros((BATCH, 1)), "rotations", level=level)
        taken.append(time.perf_counter() - begun)
    return float(np.median(taken)) / BATCH
