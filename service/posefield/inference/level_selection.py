"""Choice of levels of detail by the number of pixels that their errors cover.

A camera has a position and a lens, but no direction: a character behind it or outside the image
counts by its distance, since a mirror or a shadow may show it. Clients leave out characters that
cannot be seen.

The service stores no state between requests. Against flicker at a threshold, the client sends the
levels of the last answer, and a character becomes coarser only with a margin (HYSTERESIS).
"""

import math
from bisect import bisect_left
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from posefield.common.array_shapes import PerCharacter, Vector
from posefield.common.errors import InvalidField
from posefield.common.units import Floats, Indices, Singles

HYSTERESIS = 0.2
"""A coarser level than the previous one is chosen if its error is below the limit by this share."""
MAX_COORDINATE = 1e6
"""Largest coordinate, m: the float32 of poses resolves 6 cm at this distance."""
MIN_FOV, MAX_HEIGHT = 1e-6, 1e6
"""Smallest field of view, rad, and tallest image, pixels, for which the size of a pixel is
finite.
"""


@dataclass(frozen=True)
class Camera:
    """Camera without direction.

    position: (3,), m. fov: vertical field of view, rad. height: height of the image, pixels.
    """

    position: Vector
    fov: float
    height: float

    def __post_init__(self) -> None:
        # Written so that NaN is refused too.
        if self.position.shape != (3,) or not (np.abs(self.position) <= MAX_COORDINATE).all():
            expected = f"expected three numbers of at most {MAX_COORDINATE:g} m"
            raise InvalidField("camera/position", f"{self.position.tolist()}, {expected}")
        if not MIN_FOV <= self.fov < math.pi:
            expected = f"expected {MIN_FOV:g} to less than pi rad"
            raise InvalidField("camera/fov", f"{self.fov:g} rad, {expected}")
        if not 1.0 <= self.height <= MAX_HEIGHT:
            expected = f"expected 1 to {MAX_HEIGHT:g} pixels"
            raise InvalidField("camera/height", f"{self.height:g} pixels, {expected}")

    @property
    def pixels(self) -> float:
        """Pixels that a metre covers at a distance of a metre, in the middle of the image."""
        return self.height / (2.0 * math.tan(self.fov / 2.0))


@dataclass(frozen=True)
class LevelCriteria:
    """Limits by which levels of detail are chosen.

    pixels: largest error as seen by the camera. budget: seconds that all poses together may take;
    the pixel limit grows until they fit. previous (N,): levels of the last answer.
    """

    camera: Camera
    pixels: float
    budget: float | None
    previous: Annotated[Indices, "characters"] | None


@dataclass(frozen=True)
class LevelTable:
    """Levels of detail, finest first: errors (L,), m, and costs (L,), seconds per pose.

    Costs never increase from a level to the next. The error of a level counts as at least that of
    any finer one.
    """

    errors: Annotated[Floats, "levels"]
    costs: Annotated[Floats, "levels"]


@dataclass(frozen=True)
class LevelChoice:
    """Chosen levels (N,), and the pixel limit that they meet.

    limit: None if even the coarsest level exceeds the budget; all characters are then at the
    coarsest.
    """

    levels: Annotated[Indices, "characters"]
    limit: float | None


def pixels_per_metre(
    camera: Camera, centres: Annotated[Floats, "characters 3"], radius: float
) -> PerCharacter:
    """Return the pixels (N,) that a metre covers on each character.

    centres: (N, 3), m. radius: of each body, m. Measured at the nearest point of a body, as in the
    middle of the image; toward the edges, perspective stretches by 1 / cos² of the angle. Raises
    InvalidField with the index of a character that contains the camera.
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


def select_levels(ladder: LevelTable, scale: PerCharacter, view: LevelCriteria) -> LevelChoice:
    """Return the coarsest levels within the view's limit; within its budget, if that is tighter.

    scale: pixels (N,) that a metre covers on each character.
    """
    levels = select_by_error(ladder.errors, scale, view.pixels, view.previous)
    if view.budget is None or _seconds(levels, ladder) <= view.budget:
        return LevelChoice(levels, view.pixels)
    return select_by_budget(ladder, scale, view.budget, view.previous)


def budget_warnings(
    choice: LevelChoice, ladder: LevelTable, view: LevelCriteria
) -> tuple[str, ...]:
    """Return a warning if the budget, not the requested pixels, determined the levels."""
    if view.budget is None or choice.limit == view.pixels:
        return ()
    budget = f"the budget of {1e3 * view.budget:g} ms"
    if choice.limit is None:
        least = 1e3 * _seconds(choice.levels, ladder)
        return (f"at the coarsest level the poses take {least:.3g} ms, more than {budget}",)
    return (f"{budget} asks for errors of up to {choice.limit:.3g} pixels, not {view.pixels:g}",)


def select_by_error(
    errors: Annotated[Floats, "levels"],
    scale: PerCharacter,
    limit: float,
    previous: Annotated[Indices, "characters"] | None = None,
) -> Annotated[Indices, "characters"]:
    """Return the coarsest levels (N,) whose errors cover at most `limit` pixels; else the finest.

    errors: (L,), m. scale: (N,), pixels per metre. previous: (N,); a coarser level than these must
    meet `limit` reduced by HYSTERESIS.
    """
    return _levels(_thresholds(errors, scale, previous), limit)


def select_by_budget(
    ladder: LevelTable,
    scale: PerCharacter,
    budget: float,
    previous: Annotated[Indices, "characters"] | None = None,
) -> LevelChoice:
    """Return the levels at the smallest limit whose poses take at most `budget` seconds.

    Exact, including hysteresis: the limit is one of the thresholds at which a character changes
    level. The thresholds of each level are sorted and searched by bisection.
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
        return LevelChoice(np.full(len(scale), len(ladder.errors) - 1), None)
    return LevelChoice(_levels(thresholds, min(limits)), min(limits))


def _thresholds(
    errors: Annotated[Floats, "levels"],
    scale: PerCharacter,
    previous: Annotated[Indices, "characters"] | None,
) -> Annotated[Floats, "levels-1 characters"]:
    """Return the smallest limits (L - 1, N), pixels, for level 1, 2, ... or coarser.

    They never decrease from a level to the next.
    """
    limits = np.maximum.accumulate(errors)[1:, None] * scale
    if previous is not None:
        levels = np.arange(1, len(errors))[:, None]
        np.divide(limits, 1.0 - HYSTERESIS, out=limits, where=levels > previous)
    return limits


def _levels(
    thresholds: Annotated[Floats, "thresholds characters"], limit: float
) -> Annotated[Indices, "characters"]:
    return np.count_nonzero(thresholds <= limit, axis=0)


def _seconds(levels: Annotated[Indices, "characters"], ladder: LevelTable) -> float:
    count = len(ladder.errors)
    return float(np.bincount(levels, minlength=count) @ ladder.costs)


def _total(reached: Annotated[Indices, "levels"], ladder: LevelTable) -> float:
    """Return the seconds of all poses for counts (L,) of characters at each level or coarser."""
    return float((reached - np.append(reached[1:], 0)) @ ladder.costs)


def error_pixels(
    errors: Annotated[Floats, "levels"],
    scale: PerCharacter,
    levels: Annotated[Indices, "characters"],
) -> Annotated[Singles, "characters"]:
    """Return the pixels (N,) that the errors of the chosen levels cover."""
    return (errors[levels] * scale).astype(np.float32)
