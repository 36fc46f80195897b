"""The examples beside the contract: each operation's request is answered as its example says."""

import json
from pathlib import Path

import jsonschema
import pytest
from asking import contains

from service.web import contract

EXAMPLES = Path(__file__).parents[2] / "api/examples"
OPERATIONS = {operation.id: operation for operation in contract.load().operations}


def test_every_operation_has_an_example_and_every_example_an_operation():
    assert {folder.name for folder in EXAMPLES.iterdir()} == set(OPERATIONS)


@pytest.mark.parametrize("name", OPERATIONS)
def test_the_example_is_answered_as_it_says(name, ask, spec, loaded):
    request = read(name, "request")
    given = {"json": request["body"]} if "body" in request else {}
    # No two machines need train the same bytes.
    path = request["path"].replace("{version}", loaded.find("reach").session.digest)
    answer = ask(request["method"], path, headers=request.get("headers"), **given)
    expected = read(name, "response")
    assert answer.status_code == expected["status"], answer.text
    assert dict(answer.headers).items() >= expected["headers"].items()
    if "body" in expected:
        assert contains(answer.json(), expected["body"])
        jsonschema.validate(answer.json(), schema_of(spec, name), jsonschema.Draft202012Validator)


@pytest.mark.parametrize("name", [n for n, o in OPERATIONS.items() if o.method == "POST"])
def test_the_example_body_matches_the_schema(name, spec):
    content = operation_of(spec, name)["requestBody"]
    schema = resolve(spec, content)["content"]["application/json"]["schema"]
    schema = {**schema, "components": spec["components"]}
    jsonschema.validate(read(name, "request")["body"], schema, jsonschema.Draft202012Validator)


@pytest.mark.parametrize(
    "name",
    [
        *(f"Pose{e}" for e in ("", "Json", "Msgpack", "Npz", "Arrow")),
        "Why",
        *(f"Sigma{e}" for e in ("", "Json", "Msgpack", "Npz", "Arrow")),
        *(f"Clip{e}" for e in ("Usda", "Usdc", "Json", "Bvh", "Glb", "Npz", "Arrow", "Msgpack")),
    ],
)
def test_both_ways_to_ask_give_the_same_answer(name, ask):
    get, post = read(f"get{name}", "request"), read(f"query{name}", "request")
    by_query = ask("GET", get["path"])
    by_body = ask("POST", post["path"], json=post["body"])
    assert by_query.content == by_body.content


def read(name, part):
    return json.loads((EXAMPLES / name / f"{part}.json").read_bytes())


def operation_of(spec, name):
    operation = OPERATIONS[name]
    return spec["paths"][operation.path][operation.method.lower()]


def schema_of(spec, name):
    answer = resolve(spec, operation_of(spec, name)["responses"]["200"])
    schema = answer["content"]["application/json"]["schema"]
    return {**schema, "components": spec["components"]}


def resolve(spec, node):
    while "$ref" in node:
        kind, name = node["$ref"].removeprefix("#/components/").split("/")
        node = spec["components"][kind][name]
    return node
