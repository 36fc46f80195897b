"""Tests of the contract's examples: each request gets the response of its example."""

import contract_examples
import jsonschema
import pytest
from asking import contains
from contract_examples import EXAMPLES, OPERATIONS, each_example

from posefield.http.api import contract

# Of every answer of HTTP, or said once for all of them in the contract's introduction.
USUAL = {
    *("content-type", "content-length", "content-encoding", "vary"),
    *("x-content-type-options", "content-security-policy", "cross-origin-resource-policy"),
    "referrer-policy",
}


def test_every_operation_has_an_example_and_every_example_an_operation():
    assert {folder.name for folder in EXAMPLES.iterdir()} == set(OPERATIONS)


@each_example()
def test_the_example_is_answered_as_it_says(name, form, ask, spec, loaded):
    request = contract_examples.request(name, form)
    given = {"json": request["body"]} if "body" in request else {}
    # No two machines need train the same bytes.
    path = request["path"].replace("{version}", loaded.find("reach").session.digest)
    answer = ask(request["method"], path, headers=request.get("headers"), **given)
    expected = contract_examples.response(name, form)
    assert answer.status_code == expected["status"], answer.text
    assert dict(answer.headers).items() >= expected["headers"].items()
    node = contract.resolve(spec, operation_of(spec, name)["responses"]["200"])
    resolved = {key.lower(): contract.resolve(spec, each) for key, each in node["headers"].items()}
    assert set(answer.headers) - resolved.keys() <= USUAL
    needed = {key for key, each in resolved.items() if each.get("required")}
    assert needed <= set(answer.headers)
    if "body" in expected:
        assert contains(answer.json(), expected["body"])
        jsonschema.validate(answer.json(), schema_of(spec, name), jsonschema.Draft202012Validator)


@each_example(lambda name: OPERATIONS[name].method == "POST")
def test_the_example_body_matches_the_schema(name, form, spec):
    body = contract_examples.request(name, form)["body"]
    content = contract.resolve(spec, operation_of(spec, name)["requestBody"])["content"]
    schema = {**content["application/json"]["schema"], "components": spec["components"]}
    jsonschema.validate(body, schema, jsonschema.Draft202012Validator)


ASKED_BOTH_WAYS = [
    (name, form)
    for name in ("Pose", "Why", "Sigma", "PoseInFormat", "SigmaInFormat", "ClipInFormat")
    for operation, form in contract_examples.CASES
    if operation == f"get{name}"
]


@pytest.mark.parametrize(("name", "form"), ASKED_BOTH_WAYS)
def test_both_ways_to_ask_give_the_same_answer(name, form, ask):
    get, post = (contract_examples.request(f"{way}{name}", form) for way in ("get", "query"))
    by_query = ask("GET", get["path"])
    by_body = ask("POST", post["path"], json=post["body"])
    assert by_query.status_code == 200
    assert by_query.content == by_body.content


def operation_of(spec, name):
    operation = OPERATIONS[name]
    return spec["paths"][operation.path][operation.method.lower()]


def schema_of(spec, name):
    answer = contract.resolve(spec, operation_of(spec, name)["responses"]["200"])
    schema = answer["content"]["application/json"]["schema"]
    return {**schema, "components": spec["components"]}
