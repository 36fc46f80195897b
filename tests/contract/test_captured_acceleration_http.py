"""Captured accelerations over HTTP: on the card, and as the reference of joins."""

from dataclasses import replace

import bad_scripts
import jsonschema
import pytest
from asking import asker

from posefield.http.api.settings import Settings
from posefield.http.app import create_app
from posefield.inference import session
from posefield.registry.model_registry import ModelRegistry
from posefield.synthesis.synthesizer import Synthesizer

WALKS = {"segments": [bad_scripts.WALK, bad_scripts.HOLD, bad_scripts.WALK]}


@pytest.fixture(scope="module")
def opened(walk_path):
    return session.load(walk_path)


def served(opened):
    return asker(create_app(ModelRegistry({"walk": Synthesizer("walk", opened)}), Settings()))


@pytest.fixture(scope="module")
def now(opened):
    return served(opened)


@pytest.fixture(scope="module")
def earlier(opened):
    """A service of a file that was trained before cards had accelerations."""
    return served(replace(opened, card=replace(opened.card, captured_acceleration=None)))


def check(spec, name, value):
    schema = {"$ref": f"#/components/schemas/{name}", "components": spec["components"]}
    jsonschema.Draft202012Validator(schema).validate(value)


def test_the_card_has_the_accelerations_of_captured_clips(now, spec, opened):
    card = now("GET", "/v1/models/walk").json()
    check(spec, "ModelCard", card)
    own = opened.card.captured_acceleration
    assert card["captured_acceleration"] == {"median": own.median, "p99": own.p99}
    # Negative control: half of it does not fit the contract.
    with pytest.raises(jsonschema.ValidationError):
        check(spec, "ModelCard", {**card, "captured_acceleration": {"median": 1.0}})


@pytest.mark.parametrize("plan", ["", "?plan=true"])
def test_joins_tell_what_they_are_compared_with(now, earlier, spec, opened, plan):
    found = [
        ask("POST", f"/v1/performances.json{plan}", json=WALKS).json()["trust"]
        for ask in (now, earlier)
    ]
    for report in found:
        check(spec, "PerformanceReport", report)
    joins = [report["joins"][0] for report in found]
    assert [join["reference"] for join in joins] == ["captured", "synthesised"]
    assert joins[0]["usual"] == pytest.approx(opened.card.captured_acceleration.p99, abs=1e-6)
    assert joins[1]["usual"] != joins[0]["usual"]
