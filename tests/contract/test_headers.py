"""Tests of response headers: the contract documents all headers of the examples' responses."""

import contract_examples
from contract_examples import OPERATIONS, each_example

from posefield.http.api import contract

# Of every answer of HTTP, or said once for all of them in the contract's introduction.
USUAL = {
    *("content-type", "content-length", "content-encoding", "vary"),
    *("x-content-type-options", "content-security-policy", "cross-origin-resource-policy"),
    "referrer-policy",
}


@each_example()
def test_no_answer_has_a_header_that_the_contract_does_not_name(name, form, ask, spec, loaded):
    operation = OPERATIONS[name]
    request = contract_examples.request(name, form)
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
