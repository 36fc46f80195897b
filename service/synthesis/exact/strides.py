"""Travel of a constrained motion, for answers in place and for loops."""

import numpy as np

from service.synthesis.exact.holding import Held
from service.synthesis.walk import plane
from service.synthesis.walk.stride import Strides


def of(held: Held) -> Strides:
    """Return the cycle of a motion, or its straight line from first to last pose."""
    last = held.scene.reduced.frames - 1.0
    roots = plane.of(held.poses(np.array([0.0, last]))[1])
    durations, turns = np.array([held.duration]), held.travel[2:]
    if not held.scene.cyclic:
        return Strides(durations, roots[1:] - roots[:1], np.zeros(1), roots[:1])
    gap = np.array([held.travel[1] + 1j * held.travel[0]])
    # A cycle without its travel ends at its start.
    return Strides(durations, plane.straightened(gap, turns), turns, roots[1:] - gap)
