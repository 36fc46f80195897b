"""Tests of the JSON Schemas for agents: they say what the contract and the service say."""

import json
from pathlib import Path

import contract_examples
import jsonschema
import msgspec
import pytest

from posefield.common.errors import QueryError
from posefield.http.api import contract
from posefield.question import json_decoding
from posefield.question.performance_question import PerformanceQuestion

SCRIPTS = sorted((Path(__file__).parents[2] / "docs/scripts").glob("*.json"))
SCHEMA = contract.script_schema()
CHECK = jsonschema.Draft202012Validator(SCHEMA)
WALK = {"kind": "walk", "model": "walk"}
WRONG = {
    "no segments": {"segments": []},
    "257 segments": {"segments": [WALK] * 257},
    "unknown kind": {"segments": [{"kind": "run", "model": "walk"}]},
    "unknown field": {"segments": [{**WALK, "sped": 1.2}]},
    "a hold without seconds": {"segments": [WALK, {"kind": "hold"}]},
    "a target without a moment": {
        "segments": [
            {"kind": "act", "model": "a", "targets": [{"joint": "b", "position": [0, 1, 2]}]}
        ]
    },
    "a negative duration": {"segments": [{**WALK, "seconds": -1}]},
    "a point of three numbers": {"segments": [{**WALK, "to": [0, 1, 2]}]},
}


def keywords(node):
    """Every key of a JSON document."""
    if isinstance(node, dict):
        yield from node
        node = list(node.values())
    if isinstance(node, list):
        for part in node:
            yield from keywords(part)


def test_it_stands_alone_and_is_a_valid_schema():
    jsonschema.Draft202012Validator.check_schema(SCHEMA)
    assert not {"$ref", "discriminator", "example"} & set(keywords(SCHEMA))
    assert {"$ref", "discriminator"} <= set(keywords(contract.load_contract().document))


def test_it_has_the_fields_of_the_type():
    assert set(SCHEMA["properties"]) == set(PerformanceQuestion.__struct_fields__)
    kinds = SCHEMA["properties"]["segments"]["items"]["oneOf"]
    assert [each["properties"]["kind"]["const"] for each in kinds] == ["walk", "act", "hold"]
    assert all(each["additionalProperties"] is False for each in kinds)


@pytest.mark.parametrize("path", SCRIPTS, ids=lambda path: path.stem)
def test_the_example_scripts_are_valid(path):
    CHECK.validate(json.loads(path.read_bytes()))
    assert json_decoding.decode_question(PerformanceQuestion, path.read_bytes()).segments


def test_the_examples_of_the_contract_are_valid():
    for name, form in (("queryPerformance", None), ("queryPerformanceInFormat", "json")):
        CHECK.validate(contract_examples.request(name, form)["body"])


@pytest.mark.parametrize("wrong", WRONG.values(), ids=WRONG)
def test_the_schema_refuses_wrong_scripts(wrong):
    with pytest.raises(jsonschema.ValidationError):
        CHECK.validate(wrong)


@pytest.mark.parametrize("name", ["no segments", "257 segments", "unknown kind", "unknown field"])
def test_schema_and_type_agree(name):
    with pytest.raises(QueryError):
        json_decoding.decode_question(PerformanceQuestion, msgspec.json.encode(WRONG[name]))


def test_an_unknown_object_is_an_error():
    with pytest.raises(KeyError):
        contract.schema("Performer-ance")
