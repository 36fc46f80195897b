"""Tests of the card over HTTP: definitions of measured controls."""

import jsonschema
import pytest
from asking import asker

from posefield.http.api.settings import Settings
from posefield.http.app import create_app
from posefield.motion import measures
from posefield.motion.measures import MOMENTS, QUANTITIES, Measure
from posefield.registry import model_registry


@pytest.fixture(scope="module")
def card(measured_walk_path):
    app = create_app(model_registry.load([measured_walk_path]), Settings())
    return asker(app)("GET", "/v1/models/measured").json()


def valid(spec, name, value):
    schema = {"$ref": f"#/components/schemas/{name}", "components": spec["components"]}
    jsonschema.Draft202012Validator(schema).validate(value)


def test_a_measured_control_says_how(card, spec):
    assert [control["measure"] for control in card["controls"]] == [
        {"quantity": "speed"},
        {"quantity": "turn"},
    ]
    assert [control["unit"] for control in card["controls"]] == ["m/s", "deg"]
    valid(spec, "ModelCard", card)


def test_the_contract_knows_all_that_can_be_measured(spec):
    known = spec["components"]["schemas"]["Measure"]["properties"]
    assert tuple(known["quantity"]["enum"]) == QUANTITIES
    assert tuple(known["at"]["enum"]) == MOMENTS
    valid(spec, "Measure", measures.to_dict(Measure("height", (3, 4), "landmark", 0.25)))
    with pytest.raises(jsonschema.ValidationError):
        valid(spec, "Measure", {"quantity": "pace"})
