"""Closing of a cycle: its last pose becomes its first, but for travel and heading.

Captured cycles end a few centimetres and some speed away from where they begin. Half of the gap is
put at either end and fades out within a fifth of the cycle, so that most frames stay as captured.
The rates of change meet too (Hermite's cubic), so that the seam has no corner.
"""

from dataclasses import replace

import numpy as np

from posefield.common.units import UP, Floats
from posefield.motion import quat
from posefield.motion.clip import Clip
from posefield.motion.curves import CurveValues, clamp

FADE = 0.2
"""Share of the cycle in which half of the gap fades, at either end."""
RATE_SPAN = 0.03
"""Share of the cycle in one of the two steps over which rates of change are measured."""


def close_cycle(clip: Clip, heading: Floats) -> Clip:
    """Return a closed cycle. heading: unwrapped angle (F,) of its root about the vertical, rad.

    The root keeps its travel over the floor and the turn of the line fitted to its heading.
    """
    frames = np.arange(len(clip))
    line = np.polynomial.Polynomial.fit(frames, heading, 1)
    walking = quat.from_axis_angle(UP, line(frames))
    rotations = clip.rotations.copy()
    rotations[:, 0] = quat.mul(quat.conj(walking), rotations[:, 0])
    rotations = quat.mul(rotations, quat.exp(_rotation_offsets(rotations)))
    rotations[:, 0] = quat.mul(walking, rotations[:, 0])
    translations = clip.translations.copy()
    height = clip.root_path @ UP
    rise = _offsets(height[-1] - height[0], _height_rate_gap(height), len(clip))
    translations[:, 0] += rise[:, None] * UP
    closed = replace(clip, rotations=rotations, translations=translations)
    return closed if clip.curves is None else replace(closed, curves=_close_curves(clip.curves))


def _close_curves(own: CurveValues) -> CurveValues:
    """Close the curves of a cycle as its poses are closed, within their limits."""
    gap, step = own.values[-1] - own.values[0], _rate_step(len(own.values))
    begin = [own.values[step * k] - own.values[0] for k in (1, 2)]
    end = [own.values[-1 - step * k] - own.values[-1] for k in (1, 2)]
    rates = _rate_gap(begin, end, step / (len(own.values) - 1))
    return replace(
        own, values=clamp(own.curves, own.values + _offsets(gap, rates, len(own.values)))
    )


def _rotation_offsets(rotations: Floats) -> Floats:
    """Return rotation vectors (F, J, 3) that close rotations (F, J, 4), each after its frame."""
    step = _rate_step(len(rotations))
    gap = _log_between(rotations[0], rotations[-1])
    begin = [_log_between(rotations[0], rotations[step * k]) for k in (1, 2)]
    end = [_log_between(rotations[-1], rotations[-1 - step * k]) for k in (1, 2)]
    return _offsets(gap, _rate_gap(begin, end, step / (len(rotations) - 1)), len(rotations))


def _height_rate_gap(height: Floats) -> Floats:
    step = _rate_step(len(height))
    begin = [height[step * k] - height[0] for k in (1, 2)]
    end = [height[-1 - step * k] - height[-1] for k in (1, 2)]
    return _rate_gap(begin, end, step / (len(height) - 1))


def _rate_step(frames: int) -> int:
    """Return the frames between the three places at which a rate of change is measured."""
    return max(min(round(RATE_SPAN * (frames - 1)), (frames - 1) // 2), 1)


def _rate_gap(begin: list[Floats], end: list[Floats], share: float) -> Floats:
    """Return the rate of change at the end less that at the beginning, per cycle.

    begin, end: changes over one and two steps into the cycle from either end. share: of the cycle
    in a step. One-sided differences of second order, because limbs may turn back there.
    """
    first, last = ((4.0 * one - two) / (2.0 * share) for one, two in (begin, end))
    return np.asarray(-last - first)


def _log_between(first: Floats, last: Floats) -> Floats:
    return quat.log(quat.mul(quat.conj(first), last))


def _offsets(gap: Floats, rates: Floats, frames: int) -> Floats:
    """Return what to add to each frame (F, ...) of a cycle with a gap and a difference of rates.

    Hermite's cubic at either end: half of both at the seam, and nothing FADE of the cycle away.
    """
    share = np.linspace(0.0, 1.0, frames)
    total = np.zeros((frames, *np.shape(gap)))
    for distance, sign in ((share, 1.0), (1.0 - share, -1.0)):
        t = np.minimum(distance / FADE, 1.0)
        place, rate = (1.0 + 2.0 * t) * (1.0 - t) ** 2, FADE * t * (1.0 - t) ** 2
        total += 0.5 * sign * np.multiply.outer(place, gap) + 0.5 * np.multiply.outer(rate, rates)
    return total
