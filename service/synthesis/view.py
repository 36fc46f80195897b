"""Levels of detail by what a viewer would notice: how many pixels an error covers.

A camera is a place and a lens, without a direction. So a character behind it, or one that the image
cuts off, counts by its distance like any other: a mirror or a shadow may show it. What is nobody's
to see is the client's to leave out.

Who trembles about a threshold must not flicker. The service remembers nothing, so the client hands
back the levels of the last answer, and a character goes coarser only where there is room to spare.
"""

import math
from bisect import bisect_left
from dataclasses import dataclass

import numpy as np

from service.motion.conventions import Floats, Indices, Singles
from service.motion.errors import InvalidField

HYSTERESIS = 0.2
"""A coarser level than that held is taken where its error is below the limit by this share."""
FARTHEST = 1e6
"""Metres from the origin along an axis: float32, in which poses travel, keeps 6 cm out there."""
NARROWEST, TALLEST = 1e-6, 1e6
"""Field of view, rad, and image, pixels: beyond, a pixel has no size that a float could hold."""


@dataclass(frozen=True)
class Camera:
    """Where one looks from, position (3,), m; vertical field of view, rad; image height, pixels."""

    position: Floats
    fov: float
    height: float

    def __post_init__(self) -> None:
        # Written so that NaN is refused too.
        if self.position.shape != (3,) or not (np.abs(self.position) <= FARTHEST).all():
            expected = f"expected three numbers of at most {FARTHEST:g} m"
            raise InvalidField("camera/position", f"{self.position.tolist()}, {expected}")
        if not NARROWEST <= self.fov < math.pi:
            expected = f"expected {NARROWEST:g} to less than pi rad"
            raise InvalidField("camera/fov", f"{self.fov:g} rad, {expected}")
        if not 1.0 <= self.height <= TALLEST:
            expected = f"expected 1 to {TALLEST:g} pixels"
            raise InvalidField("camera/height", f"{self.height:g} pixels, {expected}")

    @property
    def pixels(self) -> float:
        """Pixels that a metre covers at a metre's distance, in the middle of the image."""
        return self.height / (2.0 * math.tan(self.fov / 2.0))


@dataclass(frozen=True)
class View:
    """What is wanted of a level of detail: errors of at most so many pixels to a camera.

    budget: seconds that all poses together may take; where that is too little, the limit grows
    until they fit. previous (N,): levels of the last answer.
    """

    camera: Camera
    pixels: float
    budget: float | None
    previous: Indices | None


@dataclass(frozen=True)
class Ladder:
    """Levels of detail, finest first: errors (L,), m, and costs (L,), seconds a pose.

    Costs never grow from a level to the next. A level counts as no better than any finer one.
    """

    errors: Floats
    costs: Floats


@dataclass(frozen=True)
class Choice:
    """Levels (N,), and the limit in pixels that they keep: none where the coarsest level is not
    cheap enough for the budget, and everything is at the coarsest."""

    levels: Indices
    limit: float | None


def pixels_per_metre(camera: Camera, centres: Floats, radius: float) -> Floats:
    """Pixels (N,) that a metre covers on each character, bodies of a radius, m, round centres
    (N, 3), m.

    Measured where a body is nearest, and as in the middle of the image: toward its edge
    perspective stretches further, by 1 / cos² of the angle. InvalidField names a character that
    the camera is in.
    """
    distances = np.linalg.norm(centres - camera.position, axis=-1) - radius
    inside = np.flatnonzero(distances <= 0.0)
    if len(inside):
        raise InvalidField(
            "camera/position",
            f"inside character {inside[0]}: {distances[inside[0]] + radius:.3g} m from its middle, "
            f"expected more than {radius:.3g} m",
        )
    return camera.pixels / distances


def see(ladder: Ladder, scale: Floats, view: View) -> Choice:
    """Levels for characters on which a metre covers so many pixels (N,): the coarsest that the
    view allows, or, where those do not fit into its budget, the best that do."""
    levels = choose(ladder.errors, scale, view.pixels, view.previous)
    if view.budget is None or _seconds(levels, ladder) <= view.budget:
        return Choice(levels, view.pixels)
    return fit(ladder, scale, view.budget, view.previous)


def warnings(choice: Choice, ladder: Ladder, view: View) -> tuple[str, ...]:
    """A sentence where the budget decided, and not the pixels that were asked for."""
    if view.budget is None or choice.limit == view.pixels:
        return ()
    budget = f"the budget of {1e3 * view.budget:g} ms"
    if choice.limit is None:
        least = 1e3 * _seconds(choice.levels, ladder)
        return (f"at the coarsest level the poses take {least:.3g} ms, more than {budget}",)
    return (f"{budget} asks for errors of up to {choice.limit:.3g} pixels, not {view.pixels:g}",)


def choose(errors: Floats, scale: Floats, limit: float, previous: Indices | None = None) -> Indices:
    """Coarsest levels (N,) whose errors (L,), m, cover at most `limit` pixels at a scale (N,),
    pixels a metre; the finest where none does.

    With the levels held before, (N,), a coarser one must keep `limit` less HYSTERESIS of it.
    """
    return _levels(_thresholds(errors, scale, previous), limit)


def fit(ladder: Ladder, scale: Floats, budget: float, previous: Indices | None = None) -> Choice:
    """Levels at the smallest limit at which all poses together take at most `budget` seconds.

    Exact, hysteresis included. The limit is that of some character's step to some level: steps to
    one level are sorted, and each row is searched in log N trials.
    """
    thresholds = _thresholds(ladder.errors, scale, previous)
    steps = np.sort(thresholds, axis=1)

    def fits(limit: float) -> bool:
        reached = [np.searchsorted(row, limit, side="right") for row in steps]
        return _total(np.array([len(scale), *reached]), ladder) <= budget

    firsts = [bisect_left(row, True, key=fits) for row in steps]
    limits = [float(row[i]) for row, i in zip(steps, firsts, strict=True) if i < len(row)]
    if fits(0.0):
        limits.append(0.0)
    if not limits:
        return Choice(np.full(len(scale), len(ladder.errors) - 1), None)
    return Choice(_levels(thresholds, min(limits)), min(limits))


def _thresholds(errors: Floats, scale: Floats, previous: Indices | None) -> Floats:
    """Smallest limits (L - 1, N), pixels, at which each character may be at level 1, 2, ... or
    coarser: they never fall from a level to the next."""
    limits = np.maximum.accumulate(errors)[1:, None] * scale
    if previous is not None:
        levels = np.arange(1, len(errors))[:, None]
        np.divide(limits, 1.0 - HYSTERESIS, out=limits, where=levels > previous)
    return limits


def _levels(thresholds: Floats, limit: float) -> Indices:
    return np.count_nonzero(thresholds <= limit, axis=0)


def _seconds(levels: Indices, ladder: Ladder) -> float:
    count = len(ladder.errors)
    return float(np.bincount(levels, minlength=count) @ ladder.costs)


def _total(reached: Indices, ladder: Ladder) -> float:
    """Seconds of all poses where so many characters (L,) are at each level or coarser."""
    return float((reached - np.append(reached[1:], 0)) @ ladder.costs)


def error_pixels(errors: Floats, scale: Floats, levels: Indices) -> Singles:
    """Pixels (N,) that the errors of the chosen levels cover."""
    return (errors[levels] * scale).astype(np.float32)
