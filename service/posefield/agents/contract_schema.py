"""JSON Schemas of the contract's objects, each in one document without references."""

from collections.abc import Mapping
from functools import cache
from typing import Any

from posefield.http.api import contract

DIALECT = "https://json-schema.org/draft/2020-12/schema"
PARTS = ("items", "additionalProperties", "not")
"""Keywords whose value may be a schema."""
LISTS = ("oneOf", "anyOf", "allOf")
"""Keywords whose value is a list of schemas."""


def script_schema() -> dict[str, Any]:
    """Return the JSON Schema of scripts of performances, for files that contain one."""
    return {"$schema": DIALECT, "title": "Script of a performance", **schema("PerformanceQuestion")}


@cache
def schema(name: str) -> dict[str, Any]:
    """Return the JSON Schema of an object of the contract, with its parts in place of references.

    Raises KeyError for a name that the contract does not have.
    """
    document = contract.load_contract().document
    return _standalone(document, document["components"]["schemas"][name])


def _standalone(document: Mapping[str, Any], node: Mapping[str, Any]) -> dict[str, Any]:
    """Return a node without references, and without keywords that only OpenAPI has."""
    found: dict[str, Any] = {}
    for key, value in contract.resolve(document, node).items():
        if key == "example":
            found["examples"] = [value]
        elif key == "properties":
            found[key] = {name: _standalone(document, part) for name, part in value.items()}
        elif key in LISTS:
            found[key] = [_standalone(document, part) for part in value]
        elif key in PARTS and isinstance(value, Mapping):
            found[key] = _standalone(document, value)
        elif key != "discriminator":
            found[key] = value
    return found
