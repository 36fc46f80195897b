"""Speed along a walk: curves over distance or time, ramps at both ends, distances at each frame.

A speed is known at points of distance first, or of time; a ramp is a limit of the speed there. The
two scales are converted into each other by integration, which is exact for a constant acceleration.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np

from posefield.common.errors import InvalidField
from posefield.common.units import Floats
from posefield.performance.passage import RATE
from posefield.question.motion_question import check_number

Curve = float | Sequence[tuple[float, float]]
"""A number, or pairs of a distance, m, or a time, s, and a value; linear between, constant after
the last."""
Scale = Literal["distance", "time"]

COMFORTABLE = 0.4
"""Acceleration of starts, stops and changes of speed that have no curve, m/s²."""
MAX_ACCELERATION = 1.5
"""Largest acceleration of a speed curve, m/s²."""
MAX_SECONDS = 1_600.0
"""Longest walk, s: 96,000 frames."""
# Points of a profile: metres and seconds between them, and seconds over which speed is averaged.
METRES, SECONDS, EASING = 0.02, 1.0 / 240.0, 0.3
MAX_KNOTS = 1_000


@dataclass(frozen=True)
class SpeedRamps:
    """Speeds at both ends, m/s, None where the curve's own holds, and the acceleration, m/s²."""

    first: float | None
    last: float | None
    acceleration: float = COMFORTABLE


def check_curve(field: str, curve: Curve) -> tuple[Floats, Floats]:
    """Return the knots (K,) and values (K,) of a curve.

    Raises InvalidField for numbers that are not finite and for knots that do not increase.
    """
    if isinstance(curve, int | float):
        return np.zeros(1), np.array([check_number(field, curve)])
    if not 1 <= len(curve) <= MAX_KNOTS:
        raise InvalidField(field, f"{len(curve)} pairs, expected 1 to {MAX_KNOTS}")
    pairs = np.array([_pair(f"{field}/{index}", pair) for index, pair in enumerate(curve)])
    for index in np.flatnonzero(np.diff(pairs[:, 0], prepend=-np.inf) <= 0.0)[:1].tolist():
        raise InvalidField(
            f"{field}/{index}",
            f"{pairs[index, 0]:g} after {pairs[index - 1, 0]:g}, expected a larger one: pairs in "
            "order",
        )
    if pairs[0, 0] < 0.0:
        raise InvalidField(f"{field}/0", f"{pairs[0, 0]:g}, expected 0 or more")
    return pairs[:, 0], pairs[:, 1]


def _pair(field: str, pair: object) -> tuple[float, float]:
    if not isinstance(pair, list | tuple) or len(pair) != 2:
        raise InvalidField(field, f"{pair!r}, expected a pair of numbers")
    return check_number(f"{field}/0", pair[0]), check_number(f"{field}/1", pair[1])


def check_speeds(curve: Curve, scale: Scale, limits: tuple[float, float]) -> tuple[Floats, Floats]:
    """Return knots (K,) and speeds (K,), m/s, of a speed curve.

    limits: slowest and fastest speed, m/s. Raises InvalidField for a speed outside them and for a
    larger acceleration than `MAX_ACCELERATION`.
    """
    knots, speeds = check_curve("speed", curve)
    low, high = limits
    for index in np.flatnonzero(~((speeds >= low) & (speeds <= high)))[:1].tolist():
        field = "speed" if isinstance(curve, int | float) else f"speed/{index}"
        raise InvalidField(field, f"{speeds[index]:g} m/s, expected {low:.3f} to {high:.3f} m/s")
    slopes = np.diff(speeds) / np.diff(knots)
    if scale == "distance":
        slopes *= np.maximum(speeds[1:], speeds[:-1])
    for index in np.flatnonzero(np.abs(slopes) > MAX_ACCELERATION)[:1].tolist():
        raise InvalidField(
            f"speed/{index + 1}",
            f"{slopes[index]:.2f} m/s² from the pair before, expected at most {MAX_ACCELERATION:g}",
        )
    return knots, speeds


def distances_over_length(
    curve: tuple[Floats, Floats], scale: Scale, length: float, ramps: SpeedRamps
) -> Annotated[Floats, "frames"]:
    """Return the distances (F,), m, at `RATE` frames a second, of a walk of a length, m."""
    gone = np.linspace(0.0, length, max(int(np.ceil(length / METRES)), 8) + 1)
    if scale == "distance":
        squares = _begun(gone, np.interp(gone, *curve), ramps)
    else:
        # A time, s, after which the length is walked for certain.
        slowest = float(curve[1].min())
        late = min(length / slowest + slowest / ramps.acceleration + 1.0, MAX_SECONDS + 1.0)
        times = np.arange(0.0, late, SECONDS)
        speeds = _begun_in_time(times, np.interp(times, *curve), ramps)
        squares = np.interp(gone, _integral(times, speeds), speeds) ** 2
    if ramps.last is not None:
        back = ramps.last**2 + 2.0 * ramps.acceleration * (length - gone)
        squares = np.minimum(squares, back)
    times = _times(gone, np.sqrt(squares))
    if times[-1] > MAX_SECONDS:
        raise InvalidField("speed", f"a walk of {times[-1]:.0f} s, expected {MAX_SECONDS:g} s")
    even = np.arange(0.0, times[-1] + 0.5 * SECONDS, SECONDS)
    # Speeds are linear in time between the points, as accelerations are even.
    return _frames(even, np.interp(even, times, np.sqrt(squares)), length, ramps)


def distances_over_time(
    curve: tuple[Floats, Floats], scale: Scale, seconds: float, ramps: SpeedRamps
) -> Annotated[Floats, "frames"]:
    """Return the distances (F,), m, at `RATE` frames a second, of a walk of a duration, s."""
    times = np.linspace(0.0, seconds, max(round(seconds / SECONDS), 8) + 1)
    if scale == "time":
        speeds = _begun_in_time(times, np.interp(times, *curve), ramps)
    else:
        length = seconds * float(curve[1].max())
        gone = np.linspace(0.0, length, max(int(np.ceil(length / METRES)), 8) + 1)
        walked = np.sqrt(_begun(gone, np.interp(gone, *curve), ramps))
        speeds = np.interp(times, _times(gone, walked), walked)
    if ramps.last is not None:
        speeds = np.minimum(speeds, ramps.last + ramps.acceleration * (times[-1] - times))
    return _frames(times, speeds, None, ramps)


def _begun(gone: Floats, speeds: Floats, ramps: SpeedRamps) -> Floats:
    """Return squares of speeds at distances that begin with the first speed of the ramps."""
    if ramps.first is None:
        return speeds**2
    up = 2.0 * ramps.acceleration * gone
    return np.clip(speeds**2, np.maximum(ramps.first**2 - up, 0.0), ramps.first**2 + up)


def _begun_in_time(times: Floats, speeds: Floats, ramps: SpeedRamps) -> Floats:
    if ramps.first is None:
        return speeds
    up = ramps.acceleration * times
    return np.clip(speeds, ramps.first - up, ramps.first + up)


def _times(gone: Floats, speeds: Floats) -> Floats:
    """Return times, s, of distances at which speeds, m/s, are known, for even accelerations."""
    return np.pad(np.cumsum(2.0 * np.diff(gone) / (speeds[1:] + speeds[:-1])), (1, 0))


def _integral(times: Floats, speeds: Floats) -> Floats:
    return np.pad(np.cumsum(0.5 * (speeds[1:] + speeds[:-1]) * np.diff(times)), (1, 0))


def _frames(
    times: Floats, speeds: Floats, length: float | None, ramps: SpeedRamps
) -> Annotated[Floats, "frames"]:
    """Return distances at even frames of eased speeds.

    length: that the last distance must have, m, or None. The number of frames is whole, so that
    speeds change by a part of a frame.
    """
    gone = _integral(times, _eased(speeds, ramps))
    count = max(round(times[-1] * RATE), 1) + 1
    found = np.interp(np.linspace(0.0, times[-1], count), times, gone)
    return found if length is None else found * (length / found[-1])


def _eased(speeds: Floats, ramps: SpeedRamps) -> Floats:
    """Return speeds averaged over `EASING` with raised-cosine weights.

    At an end of speed zero the speed goes on below it, so that its slope there stays.
    """
    half = min(round(0.5 * EASING / SECONDS), len(speeds) - 1)
    weights = np.hanning(2 * half + 3)[1:-1]
    before, after = speeds[1 : half + 1][::-1], speeds[-half - 1 : -1][::-1]
    before = -before if ramps.first == 0.0 else np.full(half, speeds[0])
    after = -after if ramps.last == 0.0 else np.full(half, speeds[-1])
    return np.convolve(np.hstack([before, speeds, after]), weights / weights.sum(), "valid")
