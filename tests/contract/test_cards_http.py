"""Cards over HTTP: measured controls, contacts and accelerations of captured clips."""

import jsonschema
import pytest
from asking import asker

from posefield.http.api.settings import Settings
from posefield.http.app import create_app
from posefield.inference import session
from posefield.motion import measures
from posefield.motion.measures import MOMENTS, QUANTITIES, Measure
from posefield.registry.model_registry import ModelRegistry
from posefield.synthesis.synthesizer import Synthesizer


def served(name, opened):
    return asker(create_app(ModelRegistry({name: Synthesizer(name, opened)}), Settings()))


@pytest.fixture(scope="module")
def opened(walk_path):
    return session.load(walk_path)


def test_a_measured_control_says_how(measured_walk_path, valid):
    card = served("measured", session.load(measured_walk_path))("GET", "/v1/models/measured").json()
    assert [control["measure"] for control in card["controls"]] == [
        {"quantity": "speed"},
        {"quantity": "turn"},
    ]
    assert [control["unit"] for control in card["controls"]] == ["m/s", "deg"]
    valid("ModelCard", card)


def test_the_contract_knows_all_that_can_be_measured(spec, valid):
    known = spec["components"]["schemas"]["Measure"]["properties"]
    assert tuple(known["quantity"]["enum"]) == QUANTITIES
    assert tuple(known["at"]["enum"]) == MOMENTS
    valid("Measure", measures.to_dict(Measure("height", (3, 4), "landmark", 0.25)))
    with pytest.raises(jsonschema.ValidationError):
        valid("Measure", {"quantity": "pace"})


def test_a_card_has_the_swings_of_feet_and_the_accelerations_of_clips(opened, valid):
    card, own = served("walk", opened)("GET", "/v1/models/walk").json(), opened.card
    valid("ModelCard", card)
    assert [one["joint"] for one in card["contacts"]] == card["feet"]
    assert [one["swing"] for one in card["contacts"]] == [one.swing for one in own.contacts]
    assert set(card["diagnostics"]["contacts"]) == {"agreement", "brier", "climatology"}
    median, p99 = own.captured_acceleration.median, own.captured_acceleration.p99
    assert card["captured_acceleration"] == {"median": median, "p99": p99}
    # Negative control: parts of them do not fit the contract.
    for wrong in ({"contacts": [{"joint": 3}]}, {"captured_acceleration": {"median": 1.0}}):
        with pytest.raises(jsonschema.ValidationError):
            valid("ModelCard", {**card, **wrong})
