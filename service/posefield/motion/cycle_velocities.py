"""Velocities of a cycle: those of the constant motion over the floor that covers its travel.

A travel is to the left and ahead, m, in the frame in which the cycle begins, and the change of
heading, rad. Velocities are to the left and ahead in the frame that turns with the body, m/s, and
of the heading, rad/s: the logarithm of the travel in SE(2). Both are arrays (..., 3) of NumPy,
torch or JAX, whose module is `xp`; durations (...) are seconds.
"""

from typing import Any

import numpy as np

QUANTITIES = ("left_velocity", "forward_velocity", "turn_rate")
"""Measures of the three velocities, in their order."""
Array = Any


def of_travels(xp: Any, travels: Array, durations: Array) -> Array:
    """Return the velocities of travels; of a turn by less than a whole one."""
    left, ahead, turn = (travels[..., axis] for axis in range(3))
    cosine, sine, arc = _arc(xp, turn)
    pace = 1.0 / (arc * durations)
    to_left, forward = (cosine * left - sine * ahead) * pace, (cosine * ahead + sine * left) * pace
    return xp.stack([to_left, forward, turn / durations], -1)


def travels(xp: Any, velocities: Array, durations: Array) -> Array:
    """Return the travels of velocities."""
    left, forward, turn = (velocities[..., axis] * durations for axis in range(3))
    cosine, sine, arc = _arc(xp, turn)
    to_left, ahead = (cosine * left + sine * forward) * arc, (cosine * forward - sine * left) * arc
    return xp.stack([to_left, ahead, turn], -1)


def matched(xp: Any, predicted: Array, durations: Array, goals: Array, chosen: Array) -> Array:
    """Return predicted travels with the goals' velocities where `chosen` (3,) is 1 and not 0."""
    velocities = of_travels(xp, predicted, durations)
    return travels(xp, velocities + chosen * (goals - velocities), durations)


def _arc(xp: Any, turn: Array) -> tuple[Array, Array, Array]:
    """Return cosine and sine of the direction of an arc's chord, and chord over arc."""
    return xp.cos(0.5 * turn), xp.sin(0.5 * turn), xp.sinc(turn / (2.0 * np.pi))
