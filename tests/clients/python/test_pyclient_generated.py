"""Tests of the generated modules: they are up to date with the contract and with `aio`."""

import importlib.util
from pathlib import Path

import pytest
import yaml
from posefield_client import generated

FOLDER = Path(__file__).parents[3] / "clients/python"
PACKAGE = FOLDER / "posefield_client"


@pytest.fixture(scope="module")
def generate():
    spec = importlib.util.spec_from_file_location("pyclient_generate", FOLDER / "generate.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def contract(generate):
    return yaml.safe_load(generate.CONTRACT.read_bytes())


def test_they_are_generated_anew_the_same(generate, contract):
    assert generate.module(contract) == (PACKAGE / "generated.py").read_text()
    source = (PACKAGE / "aio.py").read_text()
    assert generate.synchronous(source) == (PACKAGE / "client.py").read_text()


def test_it_is_of_this_version_and_has_all_operations(contract):
    assert generated.CONTRACT == contract["info"]["version"]
    expected = {
        (operation["operationId"], method.upper(), path)
        for path, item in contract["paths"].items()
        for method, operation in item.items()
        if method in ("get", "post")
    }
    assert {(each.id, each.method, each.path) for each in generated.OPERATIONS.values()} == expected


def test_a_changed_contract_would_be_seen_and_optional_fields_have_defaults(generate, contract):
    contract["components"]["schemas"]["Liveness"]["properties"] |= {
        "text": {"type": "string"},
        "list": {"type": "array", "items": {"type": "number"}},
        "part": {"type": ["object", "null"], "properties": {"a": {"type": "integer"}}},
    }
    written = generate.module(contract)
    assert "    text: str | None = None\n" in written
    assert "    list: tuple[float, ...] = ()\n" in written
    assert "    part: LivenessPart | None = None\n" in written
