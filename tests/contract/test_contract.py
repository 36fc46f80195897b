"""The contract is sound, and the service has its operations: all of them and no others."""

import dataclasses

import openapi_spec_validator
import pytest
from asking import asker

from service.encode import CROWD_ENCODERS, ENCODERS, POSE_ENCODERS
from service.encode.grids import GRID_ENCODERS
from service.encode.packs import PACKS
from service.synthesis.library import Library
from service.web import contract, problems
from service.web.app import build, create_app
from service.web.operations import OPERATIONS
from service.web.settings import Settings


def test_the_contract_is_valid_openapi(spec):
    openapi_spec_validator.validate(spec)


def test_routes_and_operations_are_the_same_set(spec, app):
    agreed = {
        (method.upper(), path)
        for path, item in spec["paths"].items()
        for method in item
        if method in contract.METHODS
    }
    # HEAD is answered wherever GET is, and the contract says so in its introduction.
    places = app.site.places.places
    served = {(m, place.template) for place in places for m in place.routes if m != "HEAD"}
    assert served == agreed


def test_an_operation_without_a_handler_stops_the_start():
    agreed = contract.load()
    handlers = {name: OPERATIONS[name] for name in OPERATIONS if name != "getPose"}
    with pytest.raises(ValueError, match=r"without a handler \['getPose'\]"):
        build(agreed, handlers, Library({}), Settings())


def test_a_handler_without_an_operation_stops_the_start():
    agreed = contract.load()
    fewer = tuple(o for o in agreed.operations if o.id != "getPose")
    with pytest.raises(ValueError, match=r"without an operation \['getPose'\]"):
        build(dataclasses.replace(agreed, operations=fewer), OPERATIONS, Library({}), Settings())


@pytest.mark.parametrize("extension", ENCODERS)
def test_each_format_has_the_media_type_of_its_encoder(spec, extension):
    answer = spec["components"]["responses"][f"Clip{extension.capitalize()}"]
    assert list(answer["content"]) == [ENCODERS[extension].media_type]


@pytest.mark.parametrize(
    ("method", "path", "formats"),
    [
        ("get", "pose", POSE_ENCODERS),
        ("post", "pose", POSE_ENCODERS),
        ("get", "clip", ENCODERS),
        ("post", "clip", ENCODERS),
        ("post", "clips", PACKS),
        ("get", "crowd", {name: ENCODERS[name] for name in ("usda", "usdc", "usdz")}),
        ("post", "crowd", CROWD_ENCODERS),
        ("get", "sigma", GRID_ENCODERS),
        ("post", "sigma", GRID_ENCODERS),
    ],
)
def test_each_format_has_a_path_and_stands_on_that_of_all(method, path, formats, spec):
    every = spec["paths"][f"/v1/models/{{model}}/{path}"][method]["responses"]["200"]["$ref"]
    contents = spec["components"]["responses"][every.rpartition("/")[2]]["content"]
    assert set(contents) == {found.media_type for found in formats.values()}
    assert len(contents) == len(formats)
    for name, found in formats.items():
        own = spec["paths"][f"/v1/models/{{model}}/{path}.{name}"][method]["responses"]["200"]
        answer = spec["components"]["responses"][own["$ref"].rpartition("/")[2]]
        assert answer["content"] == {found.media_type: contents[found.media_type]}


PAGES = {"/openapi.yaml", "/openapi.json", "/docs", "/problems", "/"}
OPEN = {"/livez", "/readyz", "/v2", "/v2/health/live", "/v2/health/ready", *PAGES}


def test_only_these_operations_never_ask_for_a_key():
    assert {o.path for o in contract.load().operations if o.scope is None} == OPEN


def test_every_operation_documents_the_errors_it_can_give(spec):
    for path, item in spec["paths"].items():
        for method in item.keys() & set(contract.METHODS):
            assert set(item[method]["responses"]) == expected_statuses(path, method), path


def expected_statuses(path, method):
    statuses = {"200", "400", "405", "500"}
    if path not in OPEN:
        statuses |= {"401", "403"}
    if "{model}" in path:
        statuses.add("404")
        # What answers now, and with which versions, follows from no model.
        if method == "get" and path.startswith("/v1"):
            statuses.add("304")
    if method == "get" and path in PAGES:
        statuses.add("304")
    if path.startswith(("/v1", "/v2/models")) or path.endswith(("/readyz", "/health/ready")):
        statuses.add("503")
    if path.endswith("/infer"):
        statuses.add("422")
    if path.startswith("/v1") and path.count("/") > 3:
        statuses.add("422")
        # A path that names no format asks which is accepted.
        statuses |= set() if "." in path or path.endswith(("/why", "/suggestions")) else {"406"}
    return statuses | ({"413", "415"} if method == "post" else set())


def responses(spec):
    """Each operation's responses, as (where, status, response)."""
    for path, item in spec["paths"].items():
        for method in item.keys() & set(contract.METHODS):
            for status, node in item[method]["responses"].items():
                yield f"{method} {path} {status}", status, contract.resolve(spec, node)


def test_every_error_has_the_one_shape_and_its_headers(spec):
    problem = {"application/problem+json": {"schema": {"$ref": "#/components/schemas/Problem"}}}
    for where, status, response in responses(spec):
        if status[0] in "45":
            assert response["content"] == problem, where
            assert "Link" in response["headers"], where
        assert {"X-Request-Id", "Cache-Control"} <= set(response["headers"]), where


def test_headers_that_come_with_a_status_are_documented(spec):
    special = {"304": "ETag", "401": "WWW-Authenticate", "403": "WWW-Authenticate", "405": "Allow"}
    for where, status, response in responses(spec):
        assert special.get(status, "Cache-Control") in response["headers"], where


def test_the_contract_lists_every_problem_type(spec):
    listed = spec["components"]["schemas"]["Problem"]["properties"]["type"]["enum"]
    assert set(listed) == {kind.type for kind in problems.KINDS}
    assert len(listed) == len(problems.KINDS)


def test_an_empty_library_is_an_empty_list():
    answer = asker(create_app(Library({}), Settings()))("GET", "/v1/models")
    assert answer.json() == {"models": []}
