"""Curves that lead from one place and heading to another within limits of the curvature.

A curve is an arc, a straight line and an arc: one of the words LSL, LSR, RSL and RSR of L. E.
Dubins, "On Curves of Minimal Length with a Constraint on Average Curvature", 1957, with radii of
their own to the left and to the right. Headings are averaged over a window, so that the curvature
changes gradually; the target is shifted until the averaged curve ends where it should.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from posefield.common.array_shapes import PerPoint
from posefield.performance.passages.passage import FloorMotion
from posefield.performance.walks.floor_path import FloorPath, point_count

# Window over which headings are averaged, m, and as a share of the distance where this is less.
WINDOW, WINDOW_SHARE = 0.8, 0.2
# Radii in multiples of the smallest, and the detour, as a ratio of lengths, for which a larger one
# is taken: people turn gently where there is room.
GENTLENESS, DETOUR = (4.0, 2.8, 2.0, 1.4, 1.0), 1.05
# Windows for what no curve with the whole one reaches, as shares of it.
SMALLER = (1.0, 0.3, 0.1)
# Longest curve that is taken for want of another one, over the shortest.
LONGEST = 1.5
# Points at which headings are averaged, iterations, and the largest miss, m.
AVERAGED, ITERATIONS, MISS = 33, 8, 1e-3
# A turn the other way by less than this is none of almost a whole turn, rad.
NO_TURN = 0.3


@dataclass(frozen=True)
class Radii:
    """Smallest radii of curves to the left and to the right, m."""

    left: float
    right: float

    @property
    def larger(self) -> float:
        """Larger one of the radii, m."""
        return max(self.left, self.right)

    def allow(self, curvatures: PerPoint) -> bool:
        """Return whether no curvature (K,), 1/m, is larger than those of the radii."""
        return bool(curvatures.max() <= 1.0 / self.left and curvatures.min() >= -1.0 / self.right)


@dataclass(frozen=True)
class _Word:
    """Signed radii, m, of the first and of the last arc, positive to the left; zero for no arc."""

    first: float
    last: float


@dataclass(frozen=True)
class _Curve:
    """Arc, line and arc: two turns, rad, the length of the line, m, and the word."""

    turns: tuple[float, float]
    line: float
    word: _Word

    @property
    def lengths(self) -> tuple[float, float, float]:
        """Lengths of the three parts, m."""
        first, last = self.turns
        return abs(first * self.word.first), self.line, abs(last * self.word.last)


def connect(start: FloorMotion, place: complex, heading: float | None, radii: Radii) -> FloorPath:
    """Return the path from a start to a place, with a heading there, rad, or None for any.

    Raises ValueError if there is no room for a curve of these radii.
    """
    window = min(WINDOW, WINDOW_SHARE * abs(place - start.shift))
    found: list[_Curve] = []
    every: list[_Curve] = []
    for factor in GENTLENESS:
        wider = Radii(radii.left * factor, radii.right * factor)
        curves = sorted(_curves(start, place, heading, wider), key=lambda curve: sum(curve.lengths))
        found, every = found + curves[:1], every + curves
    shortest = min(sum(curve.lengths) for curve in found)
    for curve in found:
        if sum(curve.lengths) <= DETOUR * shortest:
            path = _averaged(start, place, heading, curve.word, window)
            if path is not None:
                return path
    # Where averaged headings turn a short arc into its other way round, another curve has none.
    most = LONGEST * shortest
    for share in SMALLER:
        for curve in (own for own in every if sum(own.lengths) <= most):
            path = _averaged(start, place, heading, curve.word, share * window)
            if path is not None:
                return path
    raise ValueError("no curve")


def _curves(
    start: FloorMotion, place: complex, heading: float | None, radii: Radii
) -> Iterator[_Curve]:
    for first in (radii.left, -radii.right):
        for last in (0.0,) if heading is None else (radii.left, -radii.right):
            curve = _curve(start, place, heading, _Word(first, last))
            if curve is not None:
                yield curve


def _curve(start: FloorMotion, place: complex, heading: float | None, word: _Word) -> _Curve | None:
    """Return the curve of a word, None if its circles have no common tangent of that kind."""
    # A circle's centre is to the left of the heading; its signed radius is negative to the right.
    begin = start.shift + 1j * word.first * np.exp(1j * start.turn)
    end = place if heading is None else place + 1j * word.last * np.exp(1j * heading)
    apart, gap = end - begin, word.last - word.first
    if abs(apart) < abs(gap):
        return None
    line = float(np.sqrt(abs(apart) ** 2 - gap**2))
    along = float(np.angle(apart) - np.angle(line + 1j * gap))
    first = _turn(along - start.turn, word.first)
    last = 0.0 if heading is None else _turn(heading - along, word.last)
    return _Curve((first, last), line, word)


def _turn(angle: float, radius: float) -> float:
    """Return a turn by an angle on a circle: positive to the left, less than a whole one."""
    sign = np.sign(radius)
    return float(sign * ((sign * angle + NO_TURN) % (2.0 * np.pi) - NO_TURN))


def _averaged(
    start: FloorMotion, place: complex, heading: float | None, word: _Word, window: float
) -> FloorPath | None:
    """Return the path of a word with averaged headings; None if it does not end at the place."""
    lead = 0.5 * window
    inner = replace(start, shift=start.shift + lead * np.exp(1j * start.turn))
    aim = place if heading is None else place - lead * np.exp(1j * heading)
    tail = 0.0 if heading is None else lead
    for _ in range(ITERATIONS):
        curve = _curve(inner, aim, heading, word)
        if curve is None:
            return None
        path = _path(start, curve, (lead, tail), window)
        miss = place - path.end
        if abs(miss) < 1e-9:
            break
        aim += miss
    return path if abs(miss) < MISS else None


def _path(
    start: FloorMotion, curve: _Curve, leads: tuple[float, float], window: float
) -> FloorPath:
    lengths = (leads[0], *curve.lengths, leads[1])
    first = start.turn + curve.turns[0]
    headings = (start.turn, start.turn, first, first, first + curve.turns[1])
    knots = np.pad(np.cumsum(lengths), (1, 0))
    values = np.array([*headings, headings[-1]])
    count = point_count(knots[-1])
    at = np.linspace(0.0, knots[-1], count)
    around = window * (np.arange(AVERAGED) + 0.5) / AVERAGED - 0.5 * window
    averaged = np.interp(at[:, None] + around, knots, values).mean(axis=1)
    return FloorPath(complex(start.shift), averaged, float(knots[-1]) / (count - 1))
