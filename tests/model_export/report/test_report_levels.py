"""The report's levels of detail: the card's, with times, among others that could have been."""

import json
import math
import re
from dataclasses import replace
from html import unescape
from itertools import pairwise

import numpy as np
import pytest

from model_export.report import curve, detail, render
from service.synthesis.ports import OUTPUTS

SLOWER = (4e-6, 3e-6, 2e-6, 1e-6)


@pytest.fixture(scope="module")
def facts(rendered):
    return json.loads(rendered.json)["levels"]


@pytest.fixture(scope="module")
def page(rendered):
    return unescape(rendered.html.decode())


def without_seconds(text):
    return re.sub(r'("seconds_per_pose": )[-+.0-9e]+', r"\1", text)


def retimed(ladder):
    return replace(ladder, chosen=replace(ladder.chosen, seconds=SLOWER))


def test_the_levels_are_those_of_the_card(facts, exported):
    for found, level in zip(facts["levels"], exported.card.levels, strict=True):
        assert found["ranks"] == list(level.ranks)
        assert found["joints_that_move"] == len(level.joints)
        for name in ("numbers", "bytes", "operations"):
            assert found[name] == getattr(level, name)
        for name in ("rms", "p99", "pose", "max", "effector"):
            assert found[f"{name}_m"] == getattr(level, name)


def test_every_level_was_timed(facts):
    for ladder in (facts["levels"], facts["others"]):
        seconds = [level["seconds_per_pose"] for level in ladder]
        assert min(seconds) > 0.0 and seconds == sorted(seconds, reverse=True)


def test_a_pixel_is_as_large_as_the_error_at_its_distance(facts, exported):
    """By the tangent, along the ray to the image's upper edge: 540 pixels at 30 degrees."""
    for found, level in zip(facts["levels"], exported.card.levels, strict=True):
        half_image = found["one_pixel_from_m"] * math.tan(math.radians(30.0))
        assert 540 * level.pose / half_image == pytest.approx(1.0, rel=1e-4)
        assert 540 * level.rms / half_image < 0.5


def test_a_level_is_for_no_nearer_than_the_finer_one(ladder):
    first, *others = ladder.chosen.levels
    odd = replace(ladder, chosen=replace(ladder.chosen, levels=(replace(first, pose=9.0), *others)))
    assert odd.distances == pytest.approx([9.0 * detail.CAMERA.pixels] * 4)
    assert ladder.distances != pytest.approx([ladder.distances[0]] * 4)


def test_every_level_is_said_what_it_is_for(page, ladder):
    first, second, third, fourth = (f"{distance:.0f} m" for distance in ladder.distances)
    assert (
        f"Level 0 is for all that is exported or measured, and for characters up to {second}."
        in page
    )
    assert f"Level 1 is for characters from {second} to {third}: " in page
    assert f"Level 3 is for characters from {fourth} on: " in page
    assert f"from {first} " not in page


def test_a_model_of_one_level_has_a_report_too(ladder):
    own = detail.Paced(ladder.chosen.levels[:1], ladder.chosen.seconds[:1])
    section = replace(ladder, chosen=own).section()
    assert section.words[1:] == ("Level 0 is for all that is exported or measured.",)
    assert [len(table.rows) for table in section.tables] == [1, 1]


def test_the_curve_is_of_levels_made_alone_from_fine_to_coarse(facts, small_recipe):
    others = facts["others"]
    assert [own["times_budget"] for own in others][:: len(others) - 1] == [1.0, curve.FARTHEST]
    for finer, coarser in pairwise(others):
        assert finer["times_budget"] < coarser["times_budget"]
        assert finer["rms_m"] < coarser["rms_m"] and finer["numbers"] > coarser["numbers"]
    budget = small_recipe.size.budgets["rms"]
    # Levels are tried with some questions, and measured with others.
    kept = [own["rms_m"] <= 1.05 * own["times_budget"] * budget for own in others]
    assert all(kept)
    # Negative control: a finer level's budget would not do.
    assert not any(own["rms_m"] <= 0.5 * own["times_budget"] * budget for own in others[:5])


def test_a_point_of_the_curve_is_the_level_that_is_timed(small_recipe, trained, exported, ladder):
    """Its session answers as coarsely as the point says."""
    found = curve.of(small_recipe, trained, exported.card)
    assert (found.levels, found.times) == (ladder.others.levels, ladder.times)
    low, high = exported.model.bank.low, exported.model.bank.high
    points, times = np.linspace(low, high, 200), np.full((200, 1), 0.5)
    best = exported.model.evaluate(points, times).positions(trained.skeleton.parents)

    def off(level):
        rotations, root, offsets, *_ = found.opened.run(points, times, *OUTPUTS, level=level)
        told = exported.model.evaluate(points, times)
        answer = replace(told, rotations=rotations, root_position=root, bone_offsets=offsets)
        gaps = answer.positions(trained.skeleton.parents) - best
        return float(np.sqrt(np.mean(np.sum(gaps**2, axis=-1))))

    errors = [off(1 + number) for number in range(len(found.levels))]
    # At its own budgets a level of all clips is the model's own size over again.
    assert max(off(0), errors[0]) < 1e-4 < errors[1]
    assert errors == sorted(errors)


def test_seconds_are_all_that_differs_from_run_to_run(trained, exported, ladder, steps, rendered):
    slower = render.render(trained, exported, retimed(ladder), steps)
    text, other = rendered.json.decode(), slower.json.decode()
    assert text != other and without_seconds(text) == without_seconds(other)
    nearer = replace(ladder, times=(0.5, *ladder.times[1:]))
    changed = render.render(trained, exported, nearer, steps).json.decode()
    assert without_seconds(text) != without_seconds(changed)


def test_times_on_the_page_are_those_measured(trained, exported, ladder, steps, page):
    slower = unescape(render.render(trained, exported, retimed(ladder), steps).html.decode())
    for cell in ("4.00", "3.00", "2.00", "1.00"):
        assert re.search(rf"<td>[0-9,]+</td><td>{cell}</td></tr>", slower)
    assert "in 25 % of the finest level's time" in slower
    assert not re.search(r"<td>[0-9,]+</td><td>4.00</td></tr>", page)


def test_no_time_is_in_the_model(exported):
    assert b"seconds_per_pose" not in exported.content
