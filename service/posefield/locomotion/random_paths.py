"""Random paths within the sampled speeds and rates of turning.

The random numbers of a character are one row of a table that is generated row by row: they depend
on the seed and the character's index, not on the size of the crowd or the duration.
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from posefield.common.array_shapes import CharacterPoints, PerCharacter, PerPoint
from posefield.common.units import Floats, Indices
from posefield.locomotion import floor_plane, stride
from posefield.locomotion.floor_plane import FloorVectors
from posefield.locomotion.gait import Gait
from posefield.locomotion.paths import POINT_SPACING, Paths
from posefield.motion.crowd_clip import Placement

# Spacing of the initial grid, and largest offset of a character from its grid point, m.
SPACING, MAX_JITTER = 2.0, 0.5
# Wavelengths, m, and weights of the variation of turning and speed along a path.
WAVELENGTHS, WAVE_WEIGHTS = np.array([23.0, 11.0, 6.1]), np.array([0.5, 0.3, 0.2])
# Share of the sampled turning that is used, and relative variation of the speed.
TURNING_SHARE, SPEED_VARIATION = 0.8, 0.15
# Share of the sampled speeds that is left out at either end, where little turning was sampled.
SPEED_MARGIN = 0.05


@dataclass(frozen=True)
class Characters:
    """Performers, phases and random numbers of N characters.

    who: (N,), labels by index in `stride.label_rows`, -1 for a model without any. phases: (N,), of
    the cycle at the beginning. random_numbers: (N, columns), random numbers from 0 to 1 for the
    paths.
    """

    who: Annotated[Indices, "characters"]
    phases: PerCharacter
    random_numbers: Annotated[Floats, "characters columns"]


def draw_characters(gait: Gait, count: int, seed: int) -> Characters:
    """Return the characters of a seed."""
    table = _random_table(count, seed)
    return Characters(gait.labels.draw(table[:, 0]), table[:, 1], table[:, 2:])


def initial_placement(count: int, seed: int) -> Placement:
    """Return the initial positions and headings of `count` characters' paths."""
    drawn = _random_table(count, seed)[:, 2:]
    return Placement(
        floor_plane.at_height(_starts(drawn[:, :2]), np.zeros(count)), _initial_headings(drawn)
    )


def draw_paths(gait: Gait, characters: Characters, seconds: float) -> Paths:
    """Return random paths, long enough for `seconds` at the highest speed."""
    spot, pace = characters.random_numbers[:, :2], characters.random_numbers[:, 3]
    waves = 2.0 * np.pi * characters.random_numbers[:, 4:].reshape(len(spot), 2, len(WAVELENGTHS))
    places = int(np.ceil(gait.region.speeds[1] * seconds / POINT_SPACING)) + 3
    along = np.linspace(0.0, (places - 1) * POINT_SPACING, places)
    usual = _captured_speeds(gait, characters.who, pace)
    speeds = _speeds(gait, usual, _wave(along, waves[:, 0]))
    bends = _curvatures(gait, speeds, _wave(along, waves[:, 1]))
    # The trapezoidal rule: the curvature of a step is the mean of those at its ends.
    turns = np.cumsum(0.5 * POINT_SPACING * (bends[:, 1:] + bends[:, :-1]), axis=1)
    headings = _initial_headings(characters.random_numbers)[:, None] + np.pad(
        turns, ((0, 0), (1, 0))
    )
    return Paths(_starts(spot), headings, speeds, np.full(len(spot), along[-1]))


def _random_table(count: int, seed: int) -> Annotated[Floats, "{count} columns"]:
    return np.random.Generator(np.random.PCG64(seed)).random((count, 6 + 2 * len(WAVELENGTHS)))


def _initial_headings(
    drawn: Annotated[Floats, "characters columns"],
) -> PerCharacter:
    return 2.0 * np.pi * drawn[:, 2]


def _starts(spot: Annotated[Floats, "characters 2"]) -> Annotated[FloorVectors, "characters"]:
    """Return starts (N,), m, on a grid numbered in growing squares.

    A character's start does not depend on how many characters follow.
    """
    number = np.arange(len(spot))
    ring = np.sqrt(number).astype(np.int64)
    on = number - ring**2
    across, ahead = np.minimum(on, ring), np.minimum(2 * ring - on, ring)
    moved = MAX_JITTER * (2.0 * spot - 1.0)
    return (SPACING * ahead + moved[:, 0]) + 1j * (SPACING * across + moved[:, 1])


def _wave(along: PerPoint, phases: Annotated[Floats, "characters waves"]) -> CharacterPoints:
    """Return values (N, K) from -1 to 1 that vary smoothly along (K,) m."""
    angles = 2.0 * np.pi * along[:, None] / WAVELENGTHS + phases[:, None]
    return np.sin(angles) @ WAVE_WEIGHTS


def _captured_speeds(
    gait: Gait, who: Annotated[Indices, "characters"], drawn: PerCharacter
) -> Annotated[Floats, "characters 1"]:
    """Return speeds (N, 1), m/s, of captured clips, each of the character's own performer."""
    moved_by = stride.clip_performers(gait.session.card)
    order = np.argsort(moved_by, kind="stable")
    first, after = (np.searchsorted(moved_by[order], who, side) for side in ("left", "right"))
    clips = order[first + (drawn * (after - first)).astype(np.int64)]
    return gait.rates[clips, :1]


def _speeds(
    gait: Gait,
    usual: Annotated[Floats, "characters 1"],
    wave: CharacterPoints,
) -> CharacterPoints:
    """Return speeds (N, K), m/s, that vary about the mean ones (N, 1)."""
    ends = np.array(gait.region.speeds)
    low, high = ends + SPEED_MARGIN * (ends[::-1] - ends)
    middle = np.clip(usual, low, high)
    slower = np.maximum((1.0 - SPEED_VARIATION) * middle, low)
    faster = np.minimum((1.0 + SPEED_VARIATION) * middle, high)
    return _vary(wave, slower, middle, faster)


def _curvatures(
    gait: Gait,
    speeds: CharacterPoints,
    wave: CharacterPoints,
) -> CharacterPoints:
    """Return curvatures (N, K), 1/m; straight where the wave is zero."""
    low, high = gait.region.turning(speeds)
    return _vary(TURNING_SHARE * wave, low, np.zeros(1), high) / speeds


def _vary(wave: Floats, low: Floats, middle: Floats, high: Floats) -> Floats:
    return middle + np.where(wave < 0.0, middle - low, high - middle) * wave
