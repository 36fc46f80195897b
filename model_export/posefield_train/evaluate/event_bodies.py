"""Bodies at the event of a clip, as captured and as predicted."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from posefield.common.units import Floats
from posefield_train.evaluate.compared_motion import ComparedMotion

CAPTURED = "captured"


@dataclass(frozen=True)
class EventBody:
    """Body at the frame where the event's joint is nearest to its position at the event, m.

    joints: (J, 3). path: of the event's joint (F, 3). event: its position at the event (3,).
    """

    joints: Floats
    path: Floats
    event: Floats


EventBodies = Mapping[str, Sequence[EventBody | None]]
"""Bodies of each method, clip by clip; None for clips that it did not predict."""


def event_body(motion: ComparedMotion | None, joint: int) -> EventBody | None:
    """Return a motion's body at its event; None without motion or event."""
    if motion is None or motion.event is None:
        return None
    path = motion.joints[:, joint]
    nearest = int(np.argmin(np.linalg.norm(path - motion.event, axis=-1)))
    return EventBody(motion.joints[nearest], path, motion.event)


def median_clip(stills: EventBodies, methods: Sequence[str]) -> int | None:
    """Return the index of the clip of median effector error of the first method, or None.

    Only clips that all methods predicted count.
    """
    there = [
        place
        for place, truth in enumerate(stills.get(CAPTURED, ()))
        if truth and all(stills.get(name, [None] * (place + 1))[place] for name in methods)
    ]
    if not there:
        return None
    return sorted(there, key=lambda place: _effector_error(stills, methods[0], place))[
        len(there) // 2
    ]


def _effector_error(stills: EventBodies, name: str, place: int) -> float:
    truth, own = stills[CAPTURED][place], stills[name][place]
    assert truth and own
    return float(np.linalg.norm(own.event - truth.event))
