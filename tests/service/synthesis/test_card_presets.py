"""Tests of presets on a model card: optional, complete points within the sampled ranges."""

import re
from dataclasses import replace

import pytest
from model_cards import CARD

from posefield.model_file import card_reader, model_card
from posefield.model_file.model_card import Preset

POINT = {"height": 1.7, "turn": 20.0}
PRESETS = (
    Preset("near", POINT, {"performer": "ada"}),
    Preset("far", {"height": 1.6, "turn": -60.0}),
)


def entries(presets):
    return {k: v.encode() for k, v in model_card.dump(replace(CARD, presets=presets)).items()}


def test_presets_are_read_as_they_were_written():
    read = card_reader.decode(entries(PRESETS))
    assert read.presets == PRESETS
    assert entries(read.presets) == entries(PRESETS)
    assert model_card.plain_values(read)["presets"] == (
        {"name": "near", "controls": POINT, "labels": {}, "performer": "ada"},
        {
            "name": "far",
            "controls": {"height": 1.6, "turn": -60.0},
            "labels": {},
            "performer": None,
        },
    )


def test_a_file_without_presets_keeps_its_bytes_and_is_read():
    written = entries(())
    assert "posefield.presets" not in written
    assert card_reader.decode(written).presets == ()
    assert model_card.plain_values(CARD)["presets"] == ()


@pytest.mark.parametrize(
    ("preset", "said"),
    [
        (
            Preset("far", {"height": 1.7}),
            "presets[1].controls is ['height'], expected a value for",
        ),
        (
            Preset("far", {**POINT, "turn": 61.0}),
            "presets[1].controls.turn is 61.0, expected -60.0",
        ),
        (
            Preset("far", POINT, {"performer": "cay"}),
            "presets[1].labels.performer is cay, expected one of",
        ),
        (PRESETS[0], "presets is ['near'], expected each entry once"),
    ],
)
def test_a_wrong_preset_is_refused(preset, said):
    with pytest.raises(ValueError, match=re.escape(said)):
        card_reader.decode(entries((PRESETS[0], preset)))
