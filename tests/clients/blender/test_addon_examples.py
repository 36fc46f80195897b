"""Tests of the add-on with the contract's examples of its operations."""

import io
import json

import contract_examples
import numpy as np
import pytest
from without_blender import axes, cards, clips, service
from without_blender.clips import Question
from without_blender.service import Service


@pytest.mark.parametrize("name", ["getLiveness", "listModels", "getModel"])
def test_what_is_asked_by_get(name, address):
    found = json.loads(service.fetch(Service(address), contract_examples.request(name)["path"]))
    expected = contract_examples.response(name)["body"]
    if name == "listModels":
        named = [each["name"] for each in expected["models"]]
        assert [each for each, _ in service.models(Service(address))] == named
    else:
        assert {key: found[key] for key in expected} == expected


def test_the_card_is_read(address):
    card = cards.get(
        Service(address), contract_examples.request("getModel")["path"].rpartition("/")[2]
    )
    performers = contract_examples.response("getModel")["body"]["performers"]
    assert [list(each.names) for each in card.labels] == ([performers] if performers else [])
    assert [control.name for control in card.controls] == list(
        contract_examples.request("queryClipInFormat", "npz")["body"]["controls"]
    )


def test_the_clip_of_the_example_is_the_one_that_the_add_on_asks_for(address):
    """The example asks with Z up in centimetres; the add-on turns what comes with Y up itself."""
    example = contract_examples.request("queryClipInFormat", "npz")
    content = service.fetch(Service(address), example["path"], example["body"])
    with np.load(io.BytesIO(content), allow_pickle=False) as found:
        path, offsets = found["root_position"] / 100, found["bone_offsets"] / 100
        rotations = axes.unrolled(found["rotations"].astype(float))
    body = example["body"]
    clip = clips.ask(Service(address), Question("reach", body["controls"], fps=body["fps"]))
    count = len(path)
    np.testing.assert_allclose(clip.path[:count], path, atol=1e-6)
    np.testing.assert_allclose(clip.offsets, offsets, atol=1e-6)
    np.testing.assert_allclose(clip.rotations[:count], rotations, atol=1e-6)
    assert np.abs(clip.path[:count, [0, 2, 1]] - path).max() > 0.1
