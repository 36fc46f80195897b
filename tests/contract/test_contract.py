"""Tests of the contract: it is valid, and its operations are those of the service."""

import copy

import openapi_spec_validator
import pytest
import yaml

from posefield.http.api import contract, problems
from posefield.http.api.settings import Settings
from posefield.http.app import build_app
from posefield.http.operations import FORMATS, OPERATIONS
from posefield.registry.model_registry import ModelRegistry


def test_the_contract_is_valid_openapi(spec):
    openapi_spec_validator.validate(spec)


def test_routes_and_operations_are_the_same_set(spec, app):
    agreed = {
        (operation.method, operation.path.replace("{format}", form))
        for operation in contract.load_contract().operations
        for form in operation.formats or [""]
    }
    assert len({path.partition(".{")[0] for path in spec["paths"]}) > 10
    # HEAD is answered wherever GET is, and the contract says so in its introduction.
    paths = app.routes.paths
    served = {(m, path.template) for path in paths for m in path.routes if m != "HEAD"}
    assert served == agreed


def test_an_operation_without_a_handler_stops_the_start():
    agreed = contract.load_contract()
    handlers = {name: OPERATIONS[name] for name in OPERATIONS if name != "getPose"}
    with pytest.raises(ValueError, match=r"without a handler \['getPose'\]"):
        build_app(agreed, handlers, ModelRegistry({}), Settings())


@pytest.mark.parametrize(
    "name", sorted({name for name in OPERATIONS if name.removesuffix("InFormat") in FORMATS})
)
def test_formats_and_media_types_are_those_of_the_encoders(name):
    (operation,) = (o for o in contract.load_contract().operations if o.id == name)
    formats = FORMATS.get(name, FORMATS.get(name.removesuffix("InFormat")))
    encoders = {form: each.media_type for form, each in formats.items()}
    assert all(form == each.extension for form, each in formats.items())
    assert {*operation.media_types} == {*encoders.values()}
    assert operation.formats == (encoders if "{format}" in operation.path else {})


def changed(spec, change):
    """The contract after a change, as the service reads it."""
    other = copy.deepcopy(spec)
    change(other["components"]["parameters"]["clipEnding"], other["components"]["responses"])
    return contract.parse_contract(yaml.safe_dump(other, sort_keys=False).encode())


def without_a_format(format_, _):
    format_["schema"]["enum"].remove("glb")
    del format_["x-media-types"]["glb"]


def answered_with_less(_, responses):
    del responses["Clip"]["content"]["model/gltf-binary"]


@pytest.mark.parametrize("change", [without_a_format, answered_with_less])
def test_formats_other_than_the_encoders_stop_the_start(change, spec):
    agreed = changed(spec, change)
    with pytest.raises(ValueError, match=r"getClip.*: the contract has .*, its handler "):
        build_app(agreed, OPERATIONS, ModelRegistry({}), Settings())


PAGES = {"/openapi.yaml", "/openapi.json", "/docs", "/problems", "/"}
OPEN = {"/livez", "/readyz", *PAGES}


def test_only_these_operations_never_ask_for_a_key():
    assert {o.path for o in contract.load_contract().operations if o.scope is None} == OPEN


def test_every_operation_documents_the_errors_it_can_give(spec):
    for path, item in spec["paths"].items():
        for method in item.keys() & set(contract.METHODS):
            assert set(item[method]["responses"]) == expected_statuses(path, method), path


def expected_statuses(path, method):
    statuses = {"200", "400", "405", "414", "421", "431", "500"}
    if path not in OPEN:
        statuses |= {"401", "403"}
    if "{model}" in path or "performances" in path:
        statuses.add("404")
    if method == "get" and ("{model}" in path or path in PAGES):
        statuses.add("304")
    if path.startswith("/v1") or path == "/readyz":
        statuses.add("503")
    asks = path.count("/") > 3 and not path.endswith("/character.glb")
    if path.startswith("/v1") and (asks or "performances" in path):
        statuses.add("422")
        # A path that names no format asks which is accepted.
        statuses |= (
            set() if "{format}" in path or path.endswith(("/why", "/suggestions")) else {"406"}
        )
    return statuses | ({"413", "415"} if method == "post" else set())


def responses(spec):
    """Each operation's responses, as (where, status, response)."""
    for path, item in spec["paths"].items():
        for method in item.keys() & set(contract.METHODS):
            for status, node in item[method]["responses"].items():
                yield f"{method} {path} {status}", status, contract.resolve(spec, node)


def test_every_error_has_the_one_shape_and_its_headers(spec):
    problem = {"application/problem+json": {"schema": {"$ref": "#/components/schemas/Problem"}}}
    special = {"304": "ETag", "401": "WWW-Authenticate", "403": "WWW-Authenticate", "405": "Allow"}
    for where, status, response in responses(spec):
        if status[0] in "45":
            assert response["content"] == problem, where
            assert "Link" in response["headers"], where
        needed = {"X-Request-Id", "Cache-Control", special.get(status, "Cache-Control")}
        assert needed <= set(response["headers"]), where


def test_the_contract_lists_every_problem_type(spec):
    listed = spec["components"]["schemas"]["Problem"]["properties"]["type"]["enum"]
    assert set(listed) == {kind.type for kind in problems.PROBLEM_KINDS}
    assert len(listed) == len(problems.PROBLEM_KINDS)
