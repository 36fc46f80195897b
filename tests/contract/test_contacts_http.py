"""Contacts over HTTP: the card of a model with feet lists them, that of others does not."""

import jsonschema
import pytest
from asking import asker

from posefield.http.api.settings import Settings
from posefield.http.app import create_app
from posefield.inference import session
from posefield.registry import model_registry


@pytest.fixture(scope="module")
def asked(models):
    return asker(create_app(model_registry.load([models]), Settings()))


def test_the_card_of_a_walk_lists_its_feet_with_their_swings(asked, spec, walk_path):
    card = asked("GET", "/v1/models/walk").json()
    schema = {"$ref": "#/components/schemas/ModelCard", "components": spec["components"]}
    jsonschema.Draft202012Validator(schema).validate(card)
    assert [one["joint"] for one in card["contacts"]] == card["feet"]
    own = session.load(walk_path).card.contacts
    assert [one["swing"] for one in card["contacts"]] == [one.swing for one in own]
    assert set(card["diagnostics"]["contacts"]) == {"agreement", "brier", "climatology"}
    wrong = {**card, "contacts": [{"joint": 3}]}
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.Draft202012Validator(schema).validate(wrong)
