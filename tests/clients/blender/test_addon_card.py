"""Tests of the model card as the add-on reads it, and of values that scripts give."""

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from misbehaving import answer
from without_blender import card as cards
from without_blender.service import Fault, Service


def test_the_card_has_what_the_panel_shows(address):
    reach, walk = (cards.fetch(Service(address, seconds=60), name) for name in ("reach", "walk"))
    assert reach.identity.startswith("reach@") and reach.name == "reach"
    assert [control.name for control in reach.controls][:2] == ["stature", "hip_height"]
    assert reach.labels == {"performer": ("middle", "short", "tall")}
    assert (reach.cyclic, reach.walks, walk.cyclic, walk.walks) == (False, False, True, True)
    assert len(reach.errors) > 1 and reach.errors[0] <= reach.errors[-1]


def test_values_outside_the_sampled_range_are_named(address):
    card = cards.fetch(Service(address, seconds=60), "reach")
    values = {control.name: control.default for control in card.controls}
    assert card.outside(values) == []
    (said,) = card.outside({**values, "stature": 2.5})
    assert said.startswith("stature is 2.5, sampled: ")


def test_a_card_that_lacks_an_entry_is_refused(scripted):
    with pytest.raises(Fault, match="card is not as expected: KeyError"):
        cards.fetch(Service(scripted(answer(b'{"name": "a"}')).address), "a")


def test_a_name_stays_in_its_place():
    assert cards.path("../a b?c@0123") == "/v1/models/..%2Fa%20b%3Fc@0123"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[1]", "controls: a list, expected a JSON object"),
        ("{", "controls: Expecting property name .* line 1"),
        ('{"speed": 1}', "no control is named speed; there are turn"),
        ('{"turn": NaN}', "expected a finite number"),
    ],
)
def test_values_of_scripts_are_checked(text, words):
    with pytest.raises(Fault, match=words):
        cards.values_of_json(text, {"turn": None}, "control")


def test_values_of_scripts_are_taken():
    assert cards.values_of_json("", {}, "control") == {}
    assert cards.values_of_json('{"turn": 3}', {"turn": None}, "control") == {"turn": 3}


@given(st.floats(width=32, allow_nan=False, allow_infinity=False))
def test_a_slider_shows_the_shortest_number(value):
    assert np.float32(cards.shortest(value)) == np.float32(value)


def test_a_slider_at_a_limit_is_the_limit():
    control = cards.Control("turn", "deg", "", -45.1, 45.3, 0.1, ())
    for value in (-45.1, 45.3, 0.1):
        assert control.exact(float(np.float32(value))) == value
    assert control.exact(float(np.float32(1.72))) == 1.72
    assert json.dumps(cards.shortest(float(np.float32(29.97)))) == "29.97"
