"""Tests of label sets and of what a request says of them."""

import numpy as np
import pytest
from without_blender import cards, clips, faults, label_choice, marks
from without_blender.clips import Question
from without_blender.label_choice import LabelSet
from without_blender.service import Service

SETS = (LabelSet("performer", ("ann", "ben")), LabelSet("style", ("calm", "angry")))


@pytest.fixture(scope="module")
def models(tmp_path_factory, styled_path):
    """Return a folder of the model with performers and styles alone."""
    folder = tmp_path_factory.mktemp("styled")
    (folder / "styled.onnx").write_bytes(styled_path.read_bytes())
    return folder


def test_label_sets_are_those_of_the_card(address):
    styles = LabelSet("style", ("marching", "plain", "sneaking"))
    card = cards.get(Service(address), "styled")
    assert card.labels == (LabelSet("performer", ("ann", "ben")), styles)


def test_a_card_of_an_older_service_has_performers_alone():
    assert label_choice.of_card({"performers": ["ann", "ben"]}) == SETS[:1]
    assert label_choice.of_card({"performers": []}) == ()


def test_the_service_takes_names_and_weights(address):
    asked = Service(address)
    card = cards.get(asked, "styled")
    labels = {"performer": {"ann": 0.25, "ben": 0.75}, "style": "marching"}
    clip = clips.ask(asked, Question(card.identity, card.defaults, labels=labels))
    assert clip.answers(card.identity, card.defaults, labels)
    plain = clips.ask(asked, Question(card.identity, card.defaults, labels={"style": "plain"}))
    assert len(plain) != len(clip) or np.abs(plain.path - clip.path).max() > 1e-3


def test_an_unknown_label_is_the_services_to_refuse(address):
    with pytest.raises(faults.Refused, match="'calm', expected"):
        clips.ask(Service(address), Question("styled", {}, labels={"style": "calm"}))


def test_names_weights_and_null_are_read():
    text = '{"performer": "ann", "style": {"calm": 1, "angry": 0.5}}'
    found = {"performer": "ann", "style": {"calm": 1.0, "angry": 0.5}}
    assert label_choice.of_json(text, SETS) == found
    assert label_choice.of_json('{"style": null}', SETS) == {"style": None}
    assert label_choice.of_json("", SETS) == {}


@pytest.mark.parametrize(
    "text", ["[]", "{", '{"style": 1}', '{"style": ["calm"]}', '{"style": {"calm": NaN}}']
)
def test_what_is_no_label_is_refused(text):
    with pytest.raises(faults.Fault, match="expected a name, weights by name or null by label set"):
        label_choice.of_json(text, SETS)


def test_an_unknown_set_is_refused_with_those_that_there_are():
    with pytest.raises(faults.Fault, match="named mood; there are performer, style"):
        label_choice.of_json('{"mood": "calm"}', SETS)
    with pytest.raises(faults.Fault, match="named mood; the model has none"):
        label_choice.of_json('{"mood": "calm"}', ())


def test_a_slider_of_weights_means_the_number_that_was_put_there():
    sliders = {"calm": float(np.float32(0.7)), "angry": float(np.float32(0.3)), "glad": 0.0}
    assert sliders["calm"] != 0.7
    assert label_choice.weights(sliders) == {"calm": 0.7, "angry": 0.3}


@pytest.mark.parametrize(
    ("given", "held", "words"),
    [
        ({"calm": 0.7, "angry": 0.2}, True, "0.1 of 1 is left open"),
        ({"calm": 0.7, "angry": 0.4}, False, "sum is 1.1, expected one above 0"),
        ({}, False, "sum is 0, expected one above 0"),
    ],
)
def test_the_sum_of_weights_is_marked(given, held, words):
    found = marks.weights(given)
    assert found is not None
    assert (found.held, words in found.words) == (held, True)
    assert marks.weights({"calm": 0.7, "angry": 0.3}) is None
