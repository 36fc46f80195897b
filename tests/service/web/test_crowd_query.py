"""Tests of crowd requests: columns and scalars to arrays, and errors."""

import json
import math
import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from model_cards import CARD

from posefield.common.errors import FormError, InvalidField
from posefield.http import crowd_operations
from posefield.inference.level_selection import LevelCriteria
from posefield.model_file.model_card import LabelSet
from posefield.validation import crowd_validation

CAMERA = {"position": [0, 1.7, -5], "fov": 1.0, "height": 1080}
WHOLE = {
    "controls": {"speed": [1.0, 1.5, 2], "turn": 0.25},
    "time": [0, 0.5, 1],
    "position": [[0, 0, 0], [1, 0, 2], [3, 0, 4.5]],
    "heading": [0, 1.5, 3],
    "performer": ["ada", None, "ada"],
    "level": [0, 2, 1],
    "root": "in_place",
    "extrapolate": "refuse",
}


def asked(most=100, **body):
    return crowd_operations.of_body(json.dumps(body).encode(), most)


def changed(**body):
    """A small right question but for some fields; what is None is left out."""
    whole = {"controls": {"speed": [1.0, 2.0]}, "time": 0.0} | body
    return {key: value for key, value in whole.items() if value is not None}


def test_every_field_becomes_an_array_of_its_unit():
    found = asked(**WHOLE)
    assert len(found) == 3
    assert {name: v.tolist() for name, v in found.controls.items()} == {
        "speed": [1.0, 1.5, 2.0],
        "turn": [0.25] * 3,
    }
    assert found.times.tolist() == [0.0, 0.5, 1.0]
    assert found.placement.positions.tolist() == WHOLE["position"]
    assert found.placement.headings.tolist() == [0.0, 1.5, 3.0]
    assert [found.performers[i] for i in found.performer] == ["ada", None, "ada"]
    assert found.detail.tolist() == [0, 2, 1]
    assert (found.root, found.extrapolate) == ("in_place", "refuse")


def test_what_is_left_out_has_a_default():
    found = asked(controls={"speed": [1.0, 2.0]}, time=0)
    assert found.placement.positions.tolist() == [[0.0] * 3] * 2
    assert found.placement.headings.tolist() == found.detail.tolist() == [0, 0]
    assert [found.performers[i] for i in found.performer] == [None, None]
    assert (found.root, found.extrapolate) == ("travelling", "warn")


def test_auto_is_a_view():
    view = asked(
        **changed(level="auto", camera=CAMERA, budget_ms=5, previous_level=[0, 3], pixels=2)
    ).detail
    assert isinstance(view, LevelCriteria)
    assert view.camera.position.tolist() == [0.0, 1.7, -5.0]
    assert (view.camera.fov, view.camera.height) == (1.0, 1080.0)
    assert (view.pixels, view.budget, view.previous.tolist()) == (2.0, 0.005, [0, 3])
    plain = asked(**changed(level="auto", camera=CAMERA)).detail
    assert (plain.pixels, plain.budget, plain.previous) == (1.0, None, None)


@pytest.mark.parametrize(
    ("body", "where"),
    [
        ({"time": [0, "1"]}, "/time/1"),
        ({"controls": {"speed": [1, None]}}, "/controls/speed/1"),
        ({"controls": {"a/b": [1, True]}}, "/controls/a~1b/1"),
        ({"position": [[0, 0, 0], [0, "y", 0]]}, "/position/1/1"),
        ({"level": "auto", "camera": CAMERA | {"roll": 1}}, "/camera/roll"),
        ({"a` - b": [0]}, "/a` - b"),
    ],
)
def test_what_breaks_the_form_is_pointed_at(body, where):
    with pytest.raises(FormError) as caught:
        asked(**changed(**body))
    assert f"/{caught.value.field}" == (where or "/")


@pytest.mark.parametrize(
    ("body", "where"),
    [
        (b'{"controls": {"speed": [1, 1e999]}, "time": 0}', "controls/speed/1"),
        (b'{"controls": {}, "time": 0, "position": [[0, 0, 0], [0, -1e999, 0]]}', "position/1/1"),
        (b'{"controls": {}, "time": 0, "heading": 1e999}', "heading"),
    ],
)
def test_a_number_too_large_to_be_finite_is_pointed_at(body, where):
    with pytest.raises(FormError) as caught:
        crowd_operations.of_body(body, 100)
    assert caught.value.field == where


@pytest.mark.parametrize(
    ("body", "field", "index"),
    [
        ({"time": []}, "time", None),
        ({"time": [0] * 101}, "time", None),
        ({"controls": {"speed": [1, 2], "turn": [1, 2, 3]}}, "controls/turn", None),
        ({"position": [[0, 0, 0], [0, 0, -1.1e6]]}, "position", 1),
        ({"level": "auto"}, "camera", None),
        ({"level": "auto", "camera": CAMERA, "previous_level": [0]}, "previous_level", None),
        ({"level": "auto", "camera": CAMERA | {"fov": math.pi}}, "camera/fov", None),
    ],
)
def test_what_has_no_answer_names_the_field_and_the_character(body, field, index):
    with pytest.raises(InvalidField, match=r"expected|needs") as caught:
        asked(**changed(**body))
    assert (caught.value.field, caught.value.index) == (field, index)


def card(names):
    """Return a card with performers and, if there are any, with styles."""
    styles = LabelSet("style", ("calm", "tired"), (0, 1, 0))
    own = (LabelSet("performer", names, (0, 1, 0)), styles)
    return replace(CARD, labels=own if names else ())


def test_labels_of_several_sets_are_columns_in_the_order_of_the_card():
    given = {"style": ["tired", {"calm": 0.75, "tired": 0.25}, None, "tired"]}
    found = asked(**changed(controls={}, performer=["bo", None, "ada", "bo"], labels=given))
    rows = crowd_validation.labels(found, card(("ada", "bo")))
    assert rows[:, :2].tolist() == [[0, 1], [0, 0], [1, 0], [0, 1]]
    assert rows[:, 2:].tolist() == [[0, 1], [0.75, 0.25], [0, 0], [0, 1]]
    same = asked(**changed(controls={}, time=[0] * 3, labels={"style": "calm"}))
    assert crowd_validation.labels(same, card(("ada", "bo")))[:, 2:].tolist() == [[1, 0]] * 3


@pytest.mark.parametrize(
    ("labels", "said"),
    [
        (
            {"style": ["calm", "tierd"]},
            "labels/style/1: 'tierd' (did you mean 'tired'?), expected ",
        ),
        ({"stile": "calm"}, "labels/stile/0: 'stile' (did you mean 'style'?), expected "),
        ({"style": ["calm", {"calm": 0.7, "tired": 0.7}]}, "labels/style/1: weights with a sum of"),
        ({"style": ["calm"] * 3}, "labels/style: 3 characters, expected 2"),
        ({"performer": "ada"}, "performer: given, and labels/performer too"),
    ],
)
def test_labels_that_no_model_has_are_refused_with_the_first_character(labels, said):
    with pytest.raises(InvalidField, match=re.escape(said)):
        question = asked(**changed(controls={}, time=[0, 0], performer="bo", labels=labels))
        crowd_validation.labels(question, card(("ada", "bo")))


@pytest.mark.parametrize("known", [(), ("ada", "bo")])
def test_the_first_character_of_whom_nothing_is_known_is_named(known):
    found = asked(**changed(controls={}, performer=[None, None, "eve", "ivan", "eve"]))
    with pytest.raises(InvalidField, match="performer/2: 'eve', expected ") as caught:
        crowd_validation.labels(found, card(known))
    assert caught.value.index == 2


JSONS = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
    lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner),
    max_leaves=6,
)


@given(st.sampled_from([*WHOLE, "camera", "pixels", "budget_ms", "previous_level"]), JSONS)
def test_any_value_in_any_field_is_a_question_or_refused(name, value):
    try:
        found = asked(**WHOLE | {"level": "auto", "camera": CAMERA} | {name: value})
    except (FormError, InvalidField):
        return
    assert len(found) == 3
    assert np.isfinite(found.times).all()
