"""Tests of the card reader: round trip, and errors with path and value."""

import base64
import json
import re
from dataclasses import replace

import numpy as np
import pytest
from model_cards import CARD

from posefield.model_file import checked_file, model_card, onnx_file
from posefield.model_file.model_card import Preset

WRITTEN = {key: text.encode() for key, text in model_card.dump(CARD).items()}


def changed(path, value):
    """The entries of the card with another value at a path of keys."""
    name, *steps = path
    plain = json.loads(WRITTEN[f"posefield.{name}"])
    if not steps:
        return WRITTEN | {f"posefield.{name}": json.dumps(value).encode()}
    parent = plain
    for step in steps[:-1]:
        parent = parent[step]
    parent[steps[-1]] = value
    return WRITTEN | {f"posefield.{name}": json.dumps(plain).encode()}


def refusal(entries):
    with pytest.raises(ValueError) as caught:
        checked_file.decode_card(entries)
    return str(caught.value)


def test_a_card_read_is_the_card_written():
    read = checked_file.decode_card(WRITTEN)
    assert {key: text.encode() for key, text in model_card.dump(read).items()} == WRITTEN
    # To the last bit: weights are computed with them.
    assert read.kriging.scales.tolist() == CARD.kriging.scales.tolist()
    assert (read.levels, read.controls, read.making) == (CARD.levels, CARD.controls, CARD.making)


@pytest.mark.parametrize(
    "model", ["model_path", "labelled_path", "walk_path", "measured_walk_path"]
)
def test_what_training_writes_is_read_without_loss(model, request):
    entries = onnx_file.check(request.getfixturevalue(model).read_bytes()).metadata
    own = {key: text for key, text in entries.items() if key.startswith(model_card.PREFIX)}
    read = model_card.dump(checked_file.decode_card(entries))
    assert {key: text.encode() for key, text in read.items()} == own


@pytest.mark.parametrize("name", [key.removeprefix("posefield.") for key in WRITTEN])
def test_a_card_without_an_entry_is_refused_by_its_name(name):
    entries = {key: text for key, text in WRITTEN.items() if key != f"posefield.{name}"}
    expected = {"format": "no posefield metadata: it was not written by posefield"}
    assert refusal(entries) == expected.get(name, f"its card has no entry {name!r}")


@pytest.mark.parametrize(
    ("path", "value", "said"),
    [
        (["rate"], None, "Expected `float`, got `null`"),
        (["rate"], "x" * 10_000, "Expected `float`, got `str`"),
        (["frames"], 1.5, "Expected `int`, got `float`"),
        (["name"], "A b", "Expected `str` matching regex '^[a-z0-9][a-z0-9_-]{0,63}$'"),
        (["units", "up"], "+z", "Invalid enum value '+z' - at `$.up`"),
        (["durations"], [1], "Expected `array` of length 2"),
        (["making", "detail"], "x", "Invalid base64 encoded string - at `$.detail`"),
        (["roles"], {"hips": 3}, "Expected `str`, got `int` - at `$[...]`"),
    ],
)
def test_a_value_of_the_wrong_kind_is_refused_by_its_path(path, value, said):
    expected = f"its card's entry {path[0]!r} is wrong: {said}"
    assert refusal(changed(path, value)).startswith(expected)


@pytest.mark.parametrize("found", ["0", "4", "99", '"5"', "null", "5.0", ""])
def test_another_format_is_refused_before_anything_else_is_read(found):
    expected = f"model format {found}, this version reads format 5"
    assert refusal({"posefield.format": found.encode()}) == expected


def test_a_cycle_with_the_duration_of_repeats_is_refused():
    expected = "its card's making.repeat_duration is 0.1, expected at most 10, and 0 for a cycle"
    assert refusal(changed(["making", "repeat_duration"], 0.1)) == expected


def test_entries_of_other_producers_are_ignored():
    others = {"author": b"not JSON", "x.posefield.note": b"free text"}
    assert checked_file.decode_card(WRITTEN | others).name == "reaching"


@pytest.mark.parametrize("text", [b"free text", b"", b'"\xff"', b"NaN"])
def test_text_that_is_no_json_is_refused(text):
    assert refusal(WRITTEN | {"posefield.description": text}).startswith(
        "its card's entry 'description' is wrong: "
    )


@pytest.mark.parametrize("name", ["controls", "skeleton"])
@pytest.mark.parametrize("inner", ["", "null"])
def test_deep_nesting_is_refused(name, inner):
    deep = "[" * 200_000 + inner + "]" * 200_000
    for text in (deep, f'{{"names": {deep}}}', f'{{"other": {deep}}}'):
        found = refusal(WRITTEN | {f"posefield.{name}": text.encode()})
        assert found.startswith(f"its card's entry {name!r} is wrong: ") and len(found) < 250


def test_a_card_of_too_many_bytes_is_refused():
    text = json.dumps("x" * checked_file.MAX_CARD_BYTES).encode()
    assert "bytes, expected at most" in refusal(WRITTEN | {"posefield.description": text})


POINT = {"height": 1.7, "turn": 20.0}


PRESETS = (
    Preset("near", POINT, {"performer": "ada"}),
    Preset("far", {"height": 1.6, "turn": -60.0}),
)


def entries(presets):
    return {k: v.encode() for k, v in model_card.dump(replace(CARD, presets=presets)).items()}


def test_presets_are_read_as_they_were_written():
    read = checked_file.decode_card(entries(PRESETS))
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


@pytest.mark.parametrize(
    ("preset", "said"),
    [
        (Preset("far", {"height": 1.7}), "presets[1].controls is ['height'], expected a value for"),
        (
            Preset("far", POINT, {"performer": "cay"}),
            "presets[1].labels.performer is cay, expected one of",
        ),
    ],
)
def test_a_wrong_preset_is_refused(preset, said):
    with pytest.raises(ValueError, match=re.escape(said)):
        checked_file.decode_card(entries((PRESETS[0], preset)))


def test_making_is_in_the_file_and_not_sent_to_clients():
    entries = model_card.dump(CARD)
    assert json.loads(entries["posefield.making"]) == {
        "fields": {"warp": [0.25, 1, 0]},
        "landmarks": {"peak": 0.4},
        "joint_weights": {"chest": 2.0},
        "in_phase": True,
        "takes": [0, 0, 1],
        "take_root": [[row] * 28 for row in (0.1, 0.2, 0.3, 0.4)],
        "detail": base64.b64encode(CARD.making.detail).decode(),
    }
    assert "making" not in model_card.plain_values(CARD)


def test_bones_are_written_to_the_micrometre():
    offsets = CARD.skeleton.offsets + 1.23456789e-5
    entries = model_card.dump(replace(CARD, skeleton=replace(CARD.skeleton, offsets=offsets)))
    away = np.abs(np.array(json.loads(entries["posefield.skeleton"])["offsets"]) - offsets).max()
    assert 0.0 < away <= 0.5e-6
