"""Every header that an example's answer has is one that the contract names."""

import json
from pathlib import Path

import pytest

from service.web import contract

EXAMPLES = Path(__file__).parents[2] / "api/examples"
OPERATIONS = {operation.id: operation for operation in contract.load().operations}
# Of every answer of HTTP, or said once for all of them in the contract's introduction.
USUAL = {
    *("content-type", "content-length", "content-encoding", "vary"),
    *("x-content-type-options", "content-security-policy", "cross-origin-resource-policy"),
    "referrer-policy",
}


@pytest.mark.parametrize("name", OPERATIONS)
def test_no_answer_has_a_header_that_the_contract_does_not_name(name, ask, spec, loaded):
    operation = OPERATIONS[name]
    request = json.loads((EXAMPLES / name / "request.json").read_bytes())
    given = {"json": request["body"]} if "body" in request else {}
    path = request["path"].replace("{version}", loaded.find("reach").session.digest)
    answer = ask(request["method"], path, headers=request.get("headers"), **given)
    node = spec["paths"][operation.path][operation.method.lower()]["responses"]["200"]
    named = {header.lower() for header in contract.resolve(spec, node)["headers"]}
    assert set(answer.headers) - named <= USUAL
    needed = {
        header.lower()
        for header, each in contract.resolve(spec, node)["headers"].items()
        if contract.resolve(spec, each).get("required")
    }
    assert needed <= set(answer.headers)
