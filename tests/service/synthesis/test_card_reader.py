"""Tests of the card reader: round trip, and errors with path and value."""

import json

import pytest
from model_cards import CARD

from posefield.model_file import card_reader, model_card, onnx_check

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
        card_reader.decode(entries)
    return str(caught.value)


def test_a_card_read_is_the_card_written():
    read = card_reader.decode(WRITTEN)
    assert {key: text.encode() for key, text in model_card.dump(read).items()} == WRITTEN
    # To the last bit: weights are computed with them.
    assert read.kriging.scales.tolist() == CARD.kriging.scales.tolist()
    assert (read.levels, read.controls, read.making) == (CARD.levels, CARD.controls, CARD.making)


@pytest.mark.parametrize(
    "model", ["model_path", "labelled_path", "walk_path", "measured_walk_path"]
)
def test_what_training_writes_is_read_without_loss(model, request):
    entries = onnx_check.check(request.getfixturevalue(model).read_bytes()).metadata
    own = {key: text for key, text in entries.items() if key.startswith(model_card.PREFIX)}
    read = model_card.dump(card_reader.decode(entries))
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


@pytest.mark.parametrize("entries", [{}, {"author": b"someone", "posefield": b"1"}])
def test_metadata_of_another_producer_is_refused(entries):
    assert refusal(entries) == "no posefield metadata: it was not written by posefield"


def test_entries_of_other_producers_are_ignored():
    others = {"author": b"not JSON", "x.posefield.note": b"free text"}
    assert card_reader.decode(WRITTEN | others).name == "reaching"


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
    text = json.dumps("x" * card_reader.MAX_BYTES).encode()
    assert "bytes, expected at most" in refusal(WRITTEN | {"posefield.description": text})
