"""Requested walk of a performance: its fields that exclude each other, speeds, and obstacles.

A speed is known at points of distance first, or of time; a ramp is a limit of the speed there. The
two scales are converted into each other by integration, which is exact for a constant acceleration.

Obstacles are discs on the floor. The shortest way around them along straight lines is found in a
visibility graph of regular polygons around the discs (Lozano-Perez and Wesley, 1979) by Dijkstra's
algorithm.
"""

import heapq
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Literal

import numpy as np
import numpy.typing as npt

from posefield.common.errors import InvalidField
from posefield.common.units import Floats
from posefield.locomotion.floor_plane import FloorVectors
from posefield.performance.passage import RATE, FloorMotion
from posefield.performance.walk_paths import FloorPath
from posefield.question.motion_question import LabelValue, check_number

Curve = float | Sequence[tuple[float, float]]
"""A number, or pairs of a distance, m, or a time, s, and a value; linear between, constant after
the last."""
Scale = Literal["distance", "time"]

COMFORTABLE = 0.4
"""Acceleration of starts, stops and changes of speed that have no curve, m/s²."""
MAX_ACCELERATION = 1.5
"""Largest acceleration of a speed curve, m/s²."""
CURVE_ACCELERATION = 0.8
"""Acceleration before and after curves that are walked slower than the rest, m/s²."""
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
    curve: tuple[Floats, Floats],
    scale: Scale,
    length: float,
    ramps: SpeedRamps,
    slower: tuple[Floats, Floats] | None = None,
) -> Annotated[Floats, "frames"]:
    """Return the distances (F,), m, at `RATE` frames a second, of a walk of a length, m.

    slower: distances (K,), m, and the largest speeds there (K,), m/s, which curves of the path
    allow; None for no such limit. A walker slows down before a curve, and is faster after it.
    """
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
    if slower is not None:
        most, up = np.interp(gone, *slower) ** 2, 2.0 * CURVE_ACCELERATION * gone
        after = np.minimum.accumulate(most - up) + up
        before = np.minimum.accumulate((most + up)[::-1])[::-1] - up
        squares = np.minimum(squares, np.minimum(after, before))
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
    distances = np.interp(np.linspace(0.0, times[-1], count), times, gone)
    return distances if length is None else distances * (length / distances[-1])


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


CORNERS = 12
"""Number of corners of the polygon around a disc."""
MAX_DISCS = 32
"""Largest number of discs among which a way is searched: 386 points."""


@dataclass(frozen=True)
class Disc:
    """Disc around x and z, m, with a radius, m, which includes half the walker's width."""

    x: float
    z: float
    radius: float


def check_clear(path: FloorPath, obstacles: Sequence[Disc]) -> None:
    """Raise InvalidField, with the place, if a path crosses a disc."""
    points = path.places if obstacles else np.zeros(0, complex)
    for index, disc in enumerate(obstacles):
        distances = np.abs(points - complex(disc.z, disc.x))
        at = int(np.argmin(distances))
        if distances[at] < disc.radius:
            raise InvalidField(
                f"obstacles/{index}",
                f"the path leads within {distances[at]:.2f} m of its centre at x "
                f"{points[at].imag:.2f} m, z {points[at].real:.2f} m, expected "
                f"{disc.radius:.2f} m or more",
            )


def is_clear(path: FloorPath, obstacles: Sequence[Disc]) -> bool:
    """Return whether a path crosses no disc."""
    points = path.places
    return all(np.abs(points - complex(disc.z, disc.x)).min() >= disc.radius for disc in obstacles)


def way_around(
    start: complex, end: complex, obstacles: Sequence[Disc], clearance: float
) -> list[complex] | None:
    """Return the corners of the shortest way from one place to another, None if there is none.

    clearance: between the way and the discs, m; less where start or end are nearer to a disc.
    """
    centres = np.array([complex(disc.z, disc.x) for disc in obstacles])
    nearest = np.minimum(np.abs(centres - start), np.abs(centres - end))
    radii = np.array([disc.radius for disc in obstacles])
    grown = np.maximum(radii, np.minimum(radii + clearance, 0.95 * nearest))
    around = np.exp(2j * np.pi * np.arange(CORNERS) / CORNERS) / np.cos(np.pi / CORNERS)
    corners = (centres[:, None] + 1.001 * grown[:, None] * around).ravel()
    outside = np.all(np.abs(corners[:, None] - centres) >= grown, axis=1)
    points = np.array([start, end, *corners[outside]])
    return _shortest(points, _visible(points, centres, grown))


def _visible(
    points: Annotated[FloorVectors, "points"],
    centres: Annotated[FloorVectors, "discs"],
    radii: Annotated[Floats, "discs"],
) -> Annotated[npt.NDArray[np.bool_], "points points"]:
    """Return whether the straight lines between points (P,) cross none of the discs."""
    lines = points[None] - points[:, None]
    lengths = np.maximum(np.abs(lines), 1e-12)
    visible = np.ones(lines.shape, dtype=bool)
    for centre, radius in zip(centres, radii, strict=True):
        centre_along = (centre - points)[:, None] * np.conj(lines / lengths)
        offset = centre_along - np.clip(centre_along.real, 0.0, lengths)
        visible &= np.abs(offset) >= radius
    return visible


def _shortest(
    points: Annotated[FloorVectors, "points"],
    visible: Annotated[npt.NDArray[np.bool_], "points points"],
) -> list[complex] | None:
    """Return the corners between the first and the second of the points on the shortest way."""
    lengths, before = {0: 0.0}, {0: 0}
    queue, done = [(0.0, 0)], set[int]()
    while queue:
        gone, here = heapq.heappop(queue)
        if here == 1:
            break
        if here in done:
            continue
        done.add(here)
        for there in np.flatnonzero(visible[here]).tolist():
            length = gone + float(abs(points[there] - points[here]))
            if length < lengths.get(there, np.inf):
                lengths[there], before[there] = length, here
                heapq.heappush(queue, (length, there))
    if 1 not in lengths:
        return None
    corners = [before[1]]
    while corners[-1] != 0:
        corners.append(before[corners[-1]])
    return [complex(points[corner]) for corner in corners[-2::-1]]


Motion = Literal["rolling", "standing"]


@dataclass(frozen=True)
class WalkRequest:
    """Requested walk: exactly one of `along`, `to`, `seconds`, or `end` alone.

    along: waypoints (P, 2), x and z, m. to: point, x and z, m. facing: heading of the body all the
    way to it, rad; None for that of the way. seconds: duration, s, straight ahead or with `turn`,
    rad/s: a number or pairs of a time, s, and a rate. end: place and heading in which the walk
    ends; with `along` after its last waypoint. speed: m/s, or pairs of a distance, m, or time, s,
    and a speed. labels: name or weights by label set.
    controls: given controls by name. start, stop: whether the walk begins and ends in motion or
    standing. entry_speed, entry_turn: m/s and rad/s at which it begins in motion; None for those of
    the curves. acceleration: of starts, stops and from the entry speed, m/s². obstacles: discs.
    detour: whether a path to a place may lead around them; else one that crosses them is refused.
    """

    speed: Curve
    along: Floats | None = None
    to: tuple[float, float] | None = None
    seconds: float | None = None
    end: FloorMotion | None = None
    facing: float | None = None
    turn: Curve | None = None
    speed_over: Scale = "distance"
    labels: Mapping[str, LabelValue] = field(default_factory=dict)
    controls: Mapping[str, float] = field(default_factory=dict)
    start: Motion = "rolling"
    stop: Motion = "rolling"
    entry_speed: float | None = None
    entry_turn: float | None = None
    acceleration: float = COMFORTABLE
    obstacles: tuple[Disc, ...] = ()
    detour: bool = False


@dataclass(frozen=True)
class WalkNote:
    """Note on a plan: a code, the field that it is about, and a sentence."""

    code: str
    field: str
    message: str
