"""The contract is sound, and the service has its operations: all of them and no others."""

import dataclasses

import openapi_spec_validator
import pytest
from asking import asker

from service.encode import ENCODERS
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
    # Starlette answers HEAD wherever GET is, and the contract says so in its introduction.
    served = {(m, route.path) for route in app.routes for m in route.methods if m != "HEAD"}
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


def test_every_operation_documents_the_errors_it_can_give(spec):
    for path, item in spec["paths"].items():
        for method in item.keys() & set(contract.METHODS):
            assert set(item[method]["responses"]) == expected_statuses(path, method), path


def expected_statuses(path, method):
    statuses = {"200", "400", "405", "500"}
    if "{model}" in path:
        statuses.add("404")
    if any(word in path for word in ("/pose", "/clip", "/crowd", "/infer")):
        statuses.add("422")
    return statuses | ({"413", "415"} if method == "post" else set())


def test_the_contract_lists_every_problem_type(spec):
    kinds = {*problems.OF_REQUEST, *problems.TABLE.values(), problems.INTERNAL}
    listed = spec["components"]["schemas"]["Problem"]["properties"]["type"]["enum"]
    assert set(listed) == {problems.TYPE_PREFIX + kind.name for kind in kinds}


def test_the_served_contract_is_the_file(ask):
    assert ask("GET", "/openapi.yaml").content == contract.load().source


def test_an_empty_library_is_an_empty_list():
    answer = asker(create_app(Library({}), Settings()))("GET", "/v1/models")
    assert answer.json() == {"models": []}
