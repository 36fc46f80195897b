"""Tests of levels of detail in the report: the card's levels with times."""

import json
import math
from html import unescape

import pytest

from posefield_train.report import levels_of_detail


@pytest.fixture(scope="module")
def facts(rendered):
    return json.loads(rendered.json)["levels"]


@pytest.fixture(scope="module")
def page(rendered):
    return unescape(rendered.html.decode())


def test_the_levels_are_those_of_the_card(facts, exported):
    for found, level in zip(facts["levels"], exported.card.levels, strict=True):
        assert found["ranks"] == list(level.ranks)
        assert found["joints_that_move"] == len(level.joints)
        for name in ("numbers", "bytes", "operations"):
            assert found[name] == getattr(level, name)
        for name in ("rms", "p99", "pose", "max", "effector"):
            assert found[f"{name}_m"] == getattr(level, name)


def test_a_pixel_is_as_large_as_the_error_at_its_distance(facts, exported):
    """By the tangent, along the ray to the image's upper edge: 540 pixels at 30 degrees."""
    for found, level in zip(facts["levels"], exported.card.levels, strict=True):
        half_image = found["one_pixel_from_m"] * math.tan(math.radians(30.0))
        assert 540 * level.pose / half_image == pytest.approx(1.0, rel=1e-4)
        assert 540 * level.rms / half_image < 0.5


def test_every_level_is_said_what_it_is_for(page, levels):
    first, second, third, fourth = (f"{distance:.0f} m" for distance in levels.distances)
    assert f"Level 0 is for export and measurement, and for characters up to {second}." in page
    assert f"Level 1 is for characters from {second} to {third}: " in page
    assert f"Level 3 is for characters from {fourth} onwards: " in page
    assert f"from {first} " not in page


def test_times_fall_from_fine_to_coarse(exported):
    seconds = levels_of_detail.time_levels(exported).seconds
    assert min(seconds) > 0.0 and [*seconds] == sorted(seconds, reverse=True)
