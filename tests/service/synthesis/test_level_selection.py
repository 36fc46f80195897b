"""Tests of levels by view: the vectorised choice equals a loop over characters."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from posefield.common.errors import InvalidField
from posefield.inference import level_selection, session
from posefield.inference.level_selection import HYSTERESIS, Camera, LevelCriteria, LevelTable

ERRORS = np.array([0.0, 0.002, 0.01, 0.01, 0.05])
COSTS = np.array([4.0, 3.0, 2.0, 1.0, 0.5]) * 1e-6
LADDER = LevelTable(ERRORS, COSTS)
STEEP = LevelTable(np.array([0, 2, 5, 10, 20, 50]) * 1e-3, np.array([4, 3, 2, 1.5, 1, 0.5]) * 1e-6)
# Halfway between sums of costs, so that no rounding decides.
ROUNDING = 0.25e-6


@st.composite
def scenes(draw):
    """Ladder, scale (N,) and levels held before or None; numbers that floats add exactly, with
    many ties."""
    levels, people = draw(st.integers(1, 4)), draw(st.integers(1, 6))

    def numbers(count, low=0):
        return np.array(draw(st.lists(st.integers(low, 8), min_size=count, max_size=count)))

    errors = np.sort(numbers(levels)) / 8.0
    costs = np.sort(numbers(levels, 1))[::-1] / 8.0
    held = numbers(people) % levels if draw(st.booleans()) else None
    return LevelTable(errors, costs), numbers(people, 1).astype(float), held


def level_of(errors, scale, limit, held):
    """The definition, for one character."""
    spare = [limit if held is None or i <= held else limit * (1 - HYSTERESIS) for i in range(9)]
    kept = [i for i, error in enumerate(errors) if error * scale <= spare[i] * (1 + 1e-12)]
    return max(kept, default=0)


def one_by_one(errors, scale, limit, previous):
    held = [None] * len(scale) if previous is None else previous
    return [level_of(errors, s, limit, h) for s, h in zip(scale, held, strict=True)]


def best_limit(ladder, scale, budget, previous):
    """Smallest limit that fits, of all at which anybody's level changes."""
    products = [e * s for e in ladder.errors for s in scale]
    steps = sorted({0.0, *products, *(p / (1 - HYSTERESIS) for p in products)})
    for limit in steps:
        levels = one_by_one(ladder.errors, scale, limit, previous)
        if sum(ladder.costs[level] for level in levels) <= budget:
            return limit
    return None


@given(scenes(), st.integers(0, 80))
def test_the_choice_is_that_of_a_loop_over_characters(scene, limit):
    ladder, scale, previous = scene
    levels = level_selection.select_by_error(ladder.errors, scale, limit / 8, previous)
    assert levels.tolist() == one_by_one(ladder.errors, scale, limit / 8, previous)


@given(scenes(), st.integers(0, 60))
def test_the_fit_is_the_smallest_limit_that_a_loop_finds(scene, budget):
    ladder, scale, previous = scene
    found = level_selection.select_by_budget(ladder, scale, budget / 8, previous)
    expected = best_limit(ladder, scale, budget / 8, previous)
    assert (found.limit is None) == (expected is None)
    if expected is None:
        assert set(found.levels) == {len(ladder.errors) - 1}
        assert len(scale) * ladder.costs[-1] > budget / 8
    else:
        # The two divide in another order.
        assert found.limit == pytest.approx(expected, rel=1e-12)
        assert ladder.costs[found.levels].sum() <= budget / 8


@given(scenes(), st.integers(0, 60), st.integers(0, 80))
def test_what_is_seen_keeps_the_budget_and_is_no_worse_than_need_be(scene, budget, limit):
    ladder, scale, previous = scene
    camera = Camera(np.zeros(3), 1.0, 1080.0)
    asked = LevelCriteria(camera, limit / 8, budget / 8, previous)
    found = level_selection.select_levels(ladder, scale, asked)
    free = level_selection.select_by_error(ladder.errors, scale, limit / 8, previous)
    if ladder.costs[free].sum() <= budget / 8:
        assert found.limit == limit / 8
        assert np.array_equal(found.levels, free)
    elif found.limit is not None:
        assert found.limit > limit / 8
        assert ladder.costs[found.levels].sum() <= budget / 8


def switches(levels):
    return sum(a != b for a, b in pairwise(levels))


def trembling(holds):
    """Levels of one character while its distance wavers by a tenth about a level's threshold."""
    found, level = [], np.array([2])
    for i in range(60):
        scale = np.array([100.0 * (1.0 + 0.1 * math.sin(2.1 * i))])
        level = level_selection.select_by_error(ERRORS, scale, 1.0, level if holds else None)
        found.append(int(level[0]))
    return found


def test_a_camera_that_trembles_makes_no_character_flicker():
    assert switches(trembling(holds=True)) <= 1
    # Negative control: without the levels before it does.
    assert switches(trembling(holds=False)) > 20


def budgeted(rng, holds):
    """Count the level changes of 1,000 characters while the camera wavers by 20 cm and a budget
    allows for half the cost of all at the finest level."""
    centres = np.column_stack([rng.uniform(-30, 30, 1000), np.ones(1000), rng.uniform(0, 60, 1000)])
    before, changes = None, 0
    for i in range(40):
        place = np.array([0, 2, -5]) + 0.2 * np.sin(np.array([2.1, 1.3, 0.7]) * i)
        camera = Camera(place, 1.0, 1080.0)
        asked = LevelCriteria(camera, 0.1, 1000 * 2.2e-6 + ROUNDING, before if holds else None)
        scale = level_selection.pixels_per_metre(camera, centres, 1.0)
        found = level_selection.select_levels(STEEP, scale, asked)
        assert STEEP.costs[found.levels].sum() <= asked.budget
        changes += 0 if before is None else np.count_nonzero(found.levels != before)
        before = found.levels
    return changes


def test_nor_does_a_budget_make_them_flicker():
    with_levels, without = (budgeted(np.random.default_rng(0), holds) for holds in (True, False))
    # Negative control: without the levels before it does.
    assert with_levels <= 3 and without > 30


def test_an_error_covers_what_a_pinhole_camera_shows():
    camera = Camera(np.array([0.0, 1.0, 0.0]), math.radians(60), 1080.0)
    centres = np.array([[0.0, 1.0, 10.0], [0.0, 1.0, -10.0], [6.0, 1.0, 8.0]])
    scale = level_selection.pixels_per_metre(camera, centres, 1.0)
    # At 9 m the image is 2 * 9 * tan(30°) m high; behind the camera nothing is different.
    expected = 1080.0 / (2 * 9 * math.tan(math.radians(30)))
    np.testing.assert_allclose(scale, expected, rtol=1e-12)
    assert not np.allclose(scale, 1080.0 / (2 * 10 * math.tan(math.radians(30))), rtol=1e-12)


@pytest.mark.parametrize("away", [0.0, 0.5, 1.0])
def test_a_camera_inside_a_character_names_it(away):
    camera = Camera(np.zeros(3), 1.0, 1080.0)
    centres = np.array([[5.0, 0, 0], [0, away, 0], [0, 0, 0]])
    with pytest.raises(InvalidField, match="inside character 1: ") as caught:
        level_selection.pixels_per_metre(camera, centres, 1.0)
    assert caught.value.field == "camera/position"


@pytest.mark.parametrize(
    ("position", "fov", "height", "field"),
    [
        ((0, 0), 1.0, 1080.0, "position"),
        ((0, math.nan, 0), 1.0, 1080.0, "position"),
        ((0, 1e300, 0), 1.0, 1080.0, "position"),
        ((0, 0, 0), 0.0, 1080.0, "fov"),
        ((0, 0, 0), math.pi, 1080.0, "fov"),
        ((0, 0, 0), 1.0, 0.0, "height"),
    ],
)
def test_a_camera_that_cannot_be_is_refused(position, fov, height, field):
    with pytest.raises(InvalidField) as caught:
        Camera(np.array(position, float), fov, height)
    assert caught.value.field == f"camera/{field}"


@pytest.mark.parametrize(
    ("budget", "sentences"),
    [
        (None, ()),
        (1.0, ()),
        (0.00025, ("the budget of 0.25 ms asks for errors of up to 0.9 pixels, not 0.5",)),
        (
            0.00004,
            ("at the coarsest level the poses take 0.05 ms, more than the budget of 0.04 ms",),
        ),
    ],
)
def test_a_budget_that_decides_says_so(budget, sentences):
    asked = LevelCriteria(Camera(np.zeros(3), 1.0, 1080.0), 0.5, budget, None)
    found = level_selection.select_levels(LADDER, np.full(100, 90.0), asked)
    assert level_selection.budget_warnings(found, LADDER, asked) == sentences


@pytest.fixture(scope="module")
def opened(model_path):
    return session.load(model_path)


def test_every_level_has_a_cost(opened):
    found = level_selection.seconds_per_pose(opened)
    assert len(found) == len(opened.card.levels) == 4
    assert all(seconds > 0.0 for seconds in found)
    assert sorted(found, reverse=True) == list(found)


def test_costs_never_grow(rng):
    costs = rng.uniform(1.0, 2.0, 20)
    found = np.array(level_selection.monotone_costs(costs))
    assert np.all(np.diff(found) <= 0.0) and np.all(found <= costs)
    assert np.any(np.diff(costs) > 0.0)
