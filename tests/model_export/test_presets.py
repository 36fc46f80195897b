"""Tests of presets: named points of the controls, from the recipe to the card."""

import re
import tomllib

import fixture_models
import pytest
from minimal import TOML
from pydantic import ValidationError

from posefield.common.errors import TrainingError
from posefield.model_file import checked_file, onnx_file
from posefield.model_file.model_card import Preset
from posefield_train.source import ingest
from posefield_train.source.recipe import Recipe


def parsed(presets, before=""):
    text = TOML.replace('file = "file"\n', 'file = "file"\nperformer = "who"\n')
    return Recipe.model_validate(tomllib.loads(text + before + presets))


def test_presets_keep_their_order_and_name_a_value_for_each_control():
    own = parsed("[presets.stroll]\nspeed = 0.7\n[presets.hurry]\nspeed = 2\n")
    found = {name: (preset.values, preset.performer) for name, preset in own.presets.items()}
    assert found == {"stroll": ({"speed": 0.7}, None), "hurry": ({"speed": 2.0}, None)}
    assert parsed("").presets == {}


@pytest.mark.parametrize(
    ("presets", "said"),
    [
        ("[presets.stroll]\nspeed = 1.0\npace = 2.0\n", "found speed, pace, expected a"),
        ("[presets.stroll]\nspeed = nan\n", "presets.stroll.speed"),
        ("[presets.Stroll]\nspeed = 1.0\n", "presets.Stroll"),
        ("[presets.stroll]\nspeed = 1.0\nperformer = 'ada'\n", "found 'ada' and no kriging.label"),
    ],
)
def test_a_preset_that_is_no_point_is_refused(presets, said):
    with pytest.raises(ValidationError, match=re.escape(said)):
        parsed(presets)


def with_preset(values, performer=None):
    own = fixture_models.labelled_recipe()
    point = {"stature": 1.75, "hip_height": 0.9, "turn": 10.0, "target_height": 1.2}
    preset = {**point, **values, **({"performer": performer} if performer else {})}
    plain = own.model_dump(by_alias=True, exclude={"presets"}, exclude_none=True)
    return Recipe.model_validate({**plain, "presets": {"reach": preset}})


@pytest.mark.parametrize(
    ("values", "performer", "said"),
    [
        ({"turn": 120.0}, None, "presets.reach.turn: found 120, expected -"),
        ({}, "nobody", "presets.reach.performer: found 'nobody', expected one of "),
    ],
)
def test_a_preset_outside_the_clips_is_refused(values, performer, said):
    with pytest.raises(TrainingError, match=re.escape(said)):
        ingest.check_presets(with_preset(values, performer), fixture_models.reaches())
    performer = fixture_models.reaches()[0].row.performer
    ingest.check_presets(with_preset({}, performer), fixture_models.reaches())


def test_the_card_carries_the_presets_of_the_recipe():
    content = fixture_models.exported("reaching").content
    card = checked_file.decode_card(onnx_file.check(content).metadata)
    own = fixture_models.small_recipe().presets
    assert list(own) == ["high_shelf", "to_the_side", "seated"]
    expected = [Preset(name, preset.values, {}) for name, preset in own.items()]
    assert list(card.presets) == expected
