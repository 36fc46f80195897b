"""Clips at their events, as they were captured and as several methods have them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from model_export.evaluate.motion import Motion
from service.motion.conventions import Floats

CAPTURED = "captured"


@dataclass(frozen=True)
class Still:
    """joints (J, 3), m, when an effector is nearest to where its event is, its path (F, 3) and
    that place (3,)."""

    joints: Floats
    path: Floats
    event: Floats


Stills = Mapping[str, Sequence[Still | None]]
"""Of each method, clip by clip; None where it was not asked."""


def still(motion: Motion | None, joint: int) -> Still | None:
    """A motion at its event; None of one that has none."""
    if motion is None or motion.event is None:
        return None
    path = motion.joints[:, joint]
    nearest = int(np.argmin(np.linalg.norm(path - motion.event, axis=-1)))
    return Still(motion.joints[nearest], path, motion.event)


def chosen(stills: Stills, methods: Sequence[str]) -> int | None:
    """The clip in the middle of how far the first method is off at the event, of those that all
    were asked for."""
    there = [
        place
        for place, truth in enumerate(stills.get(CAPTURED, ()))
        if truth and all(stills.get(name, [None] * (place + 1))[place] for name in methods)
    ]
    if not there:
        return None
    return sorted(there, key=lambda place: _off(stills, methods[0], place))[len(there) // 2]


def _off(stills: Stills, name: str, place: int) -> float:
    truth, own = stills[CAPTURED][place], stills[name][place]
    assert truth and own
    return float(np.linalg.norm(own.event - truth.event))
