"""Tests of take, detail and feet: fields of requests, and what answers say of feet in words."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from without_blender import cards, clips, faults, service, variation
from without_blender.cards import Card
from without_blender.clips import Question
from without_blender.service import Service
from without_blender.variation import Variation

SHIPPED = Path(__file__).parents[3] / "service/posefield/shipped"
FEET = {
    "stances": [{"joint": "LeftToe", "begin": 0.1, "end": 0.6, "position": [0, 0, 0]}] * 3,
    "swings": 1,
    "skate_before": 0.1312,
    "skate": 0.0131,
    "drift": 0.0,
    "lowered": 0.0213,
    "grounded": 0.0,
    "left": [],
}


@pytest.fixture(scope="module")
def models(tmp_path_factory, model_path):
    """Return a folder of the captured walk, and of a reach without feet, contacts and detail."""
    folder = tmp_path_factory.mktemp("varied")
    shutil.copy(SHIPPED / "cmu_walk.onnx", folder / "cmu_walk.onnx")
    shutil.copy(model_path, folder / "reach.onnx")
    return folder


def asked(address: str, model: str, chosen: Variation) -> tuple[Card, clips.Clip]:
    card = cards.get(Service(address), model)
    question = Question(card.identity, card.defaults, variation=chosen)
    return card, clips.ask(Service(address), question)


def test_older_services_are_not_sent_what_they_do_not_know():
    plain = Question("walk", {}).body()
    assert not {"take", "variety", "detail", "feet"} & set(plain)
    assert Question("walk", {}, variation=Variation(variety=0.2)).body() == plain
    varied = Variation(7, 0.4, detail=True, feet="as_predicted")
    more = {"take": 7, "variety": 0.4, "detail": True, "feet": "as_predicted"}
    assert Question("walk", {}, variation=varied).body() == plain | more


def test_a_take_differs_and_is_the_same_again(address):
    card, mean = asked(address, "cmu_walk", Variation())
    _, other = asked(address, "cmu_walk", Variation(7))
    _, again = asked(address, "cmu_walk", Variation(7))
    np.testing.assert_array_equal(other.rotations, again.rotations)
    assert other.trust["take"] == {"seed": 7, "variety": 0.7, "detail": False}
    assert len(mean) != len(other) or np.abs(mean.path - other.path).max() > 1e-3
    assert card.detail
    assert "take" not in mean.trust


def test_details_are_asked_for_where_the_card_has_them(address):
    _, varied = asked(address, "cmu_walk", Variation(0, detail=True))
    assert varied.trust["take"]["detail"]
    assert Variation(detail=True).matches(varied.trust)
    assert not cards.get(Service(address), "reach").detail


def test_feet_stand_unless_the_prediction_is_asked_for(address):
    card, standing = asked(address, "cmu_walk", Variation())
    said = Variation().feet_sentences(standing.trust, card.why_no_stances)
    assert (card.feet, card.why_no_stances) == (True, "")
    assert said[0].startswith("Feet stand: ") and "cm/s, as predicted at" in said[1]
    _, predicted = asked(address, "cmu_walk", Variation(feet="as_predicted"))
    assert Variation(feet="as_predicted").feet_sentences(predicted.trust, "") == [
        "Feet are as predicted: as asked"
    ]


def test_feet_stand_on_a_floor_of_a_height(address):
    raised = variation.of_sliders(0, 0.7, False, "default", float(np.float32(0.2)))
    assert raised == Variation(floor=0.2) and raised.fields() == {"floor": 0.2}
    _, usual = asked(address, "cmu_walk", Variation())
    _, standing = asked(address, "cmu_walk", raised)
    # Z is up.
    assert np.abs(standing.path - usual.path - [0.0, 0.0, 0.2]).max() < 1e-5
    assert raised.matches(standing.trust) and not Variation().matches(standing.trust)
    assert not raised.matches(usual.trust)
    with pytest.raises(faults.Refused, match="floor"):
        asked(address, "cmu_walk", Variation(feet="as_predicted", floor=0.2))


def test_a_model_without_feet_says_why_nothing_was_done(address):
    card, clip = asked(address, "reach", Variation())
    assert not card.feet
    assert Variation().feet_sentences(clip.trust, card.why_no_stances) == [
        f"Feet are as predicted: {card.why_no_stances}"
    ]
    with pytest.raises(faults.Refused, match="feet"):
        asked(address, "reach", Variation(feet="stand"))


def test_a_card_of_an_older_service_has_neither_detail_nor_contacts(address):
    path = service.path_of("cmu_walk")
    plain = json.loads(service.fetch(Service(address), path))
    del plain["contacts"], plain["diagnostics"]
    card = cards.decode(json.dumps(plain).encode())
    assert (card.detail, card.feet) == (False, True)
    assert card.why_no_stances == "the model knows no contacts of its feet"


@pytest.mark.parametrize(
    ("card", "why"),
    [
        ({"root": "in_place", "feet": [1], "contacts": [{}]}, "the root of this motion stays"),
        ({"root": "travelling", "feet": []}, "the model names no feet"),
        ({}, "the model names no feet"),
        ({"root": "travelling", "feet": [1], "contacts": []}, "the model knows no contacts"),
    ],
)
def test_why_feet_are_as_predicted(card, why):
    assert variation.why_no_stances(card).startswith(why)


def test_what_was_planned_is_said_in_words():
    said = Variation().feet_sentences({"feet": FEET}, "")
    assert said == [
        "Feet stand: 3 stances, 1 swing",
        "Feet slide at 1.3 cm/s, as predicted at 13.1",
        "Pelvis lowered by up to 2.1 cm",
    ]
    left = ["LeftToe is as predicted: its leg meets an exact target"]
    one = {"feet": FEET | {"lowered": 0.0004, "left": left}}
    assert Variation().feet_sentences(one, "") == said[:2] + left
    none = {"feet": FEET | {"stances": [], "left": left}}
    assert Variation().feet_sentences(none, "") == left
    assert Variation().feet_sentences({}, "") == ["Feet are as predicted"]


def test_an_answer_matches_the_variation_that_was_asked_for():
    own = Variation(7, 0.4, feet="stand")
    trust = {"take": {"seed": 7, "variety": 0.4, "detail": False}, "feet": FEET}
    assert own.matches(trust)
    for other in ({"seed": 8}, {"variety": 0.7}, {"detail": True}, {"feet": "as_predicted"}):
        assert not replace(own, **other).matches(trust), other
    assert replace(own, feet="default").matches(trust)
    # Of the prediction, variety says nothing.
    assert Variation(variety=0.2).matches({})
    assert not own.matches({})


def test_seeds_are_counted_up_and_begin_again():
    assert [variation.next_seed(seed) for seed in (0, 7)] == [1, 8]
    assert variation.next_seed(variation.LARGEST_SEED) == 1


def test_a_slider_means_the_number_that_was_put_there():
    assert variation.of_sliders(3, float(np.float32(0.7)), False, "default") == Variation(3)
    assert float(np.float32(0.7)) != 0.7


@pytest.mark.parametrize(
    ("feet", "words"),
    [
        ([], "feet are"),
        (FEET | {"skate": None}, "expected numbers"),
        (FEET | {"lowered": np.inf}, "expected numbers"),
        (FEET | {"stances": 2}, "no lists"),
    ],
)
def test_what_says_no_such_thing_about_feet_is_refused(feet, words):
    variation.check_feet(FEET)
    with pytest.raises(ValueError, match=words):
        variation.check_feet(feet)
    with pytest.raises(KeyError, match="skate_before"):
        variation.check_feet({"stances": [], "left": [], "swings": 0})
