"""The API contract (api/openapi.yaml) and its operations."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache, cached_property
from pathlib import Path
from typing import Any

import yaml

MEDIA_TYPE = "application/yaml"
DIALECT = "https://json-schema.org/draft/2020-12/schema"
PARTS = ("items", "additionalProperties", "not")
"""Keywords whose value may be a schema."""
LISTS = ("oneOf", "anyOf", "allOf")
"""Keywords whose value is a list of schemas."""
METHODS = ("get", "put", "post", "delete", "options", "head", "patch", "trace")


@dataclass(frozen=True)
class Operation:
    """One operation of the contract.

    query: names of its query parameters. open_query: other names are allowed too, since one
    parameter is an exploded object (the controls of a model). media_types: of successful responses.
    formats: media types by format; empty for a path without `{format}`. responses: status codes.
    scope: scope that a key or token needs; None for an operation that needs no credentials.
    """

    id: str
    method: str
    path: str
    query: frozenset[str]
    open_query: bool
    media_types: tuple[str, ...] = ()
    formats: Mapping[str, str] = field(default_factory=dict)
    responses: frozenset[str] = frozenset()
    scope: str | None = None

    @cached_property
    def sheddable(self) -> bool:
        """True if it is refused under overload; monitoring operations are not."""
        return self.scope == "read"

    @cached_property
    def pure(self) -> bool:
        """True if its response depends only on the model and the request line (cacheable)."""
        return "304" in self.responses


@dataclass(frozen=True)
class Contract:
    """A parsed contract.

    source: bytes of the YAML file. document: the parsed file.
    """

    source: bytes
    document: Mapping[str, Any]
    operations: tuple[Operation, ...]

    @property
    def version(self) -> str:
        """Version of the contract (the service has another)."""
        return str(self.document["info"]["version"])


def load_contract() -> Contract:
    """Return the contract in openapi.yaml beside this module."""
    source = Path(__file__).with_name("openapi.yaml").read_bytes()
    return parse_contract(source)


def parse_contract(source: bytes) -> Contract:
    """Return the contract of a YAML document."""
    document = yaml.load(source, yaml.CSafeLoader)
    return Contract(source, document, tuple(_operations(document)))


def _operations(document: Mapping[str, Any]) -> Iterator[Operation]:
    for path, item in document["paths"].items():
        for method in (m for m in item if m in METHODS):
            listed = [*item.get("parameters", []), *item[method].get("parameters", [])]
            parameters = [resolve(document, node) for node in listed]
            query = [p for p in parameters if p["in"] == "query"]
            exploded = [p["name"] for p in query if p["schema"].get("type") == "object"]
            yield Operation(
                id=item[method]["operationId"],
                method=method.upper(),
                path=path,
                query=frozenset(p["name"] for p in query) - set(exploded),
                open_query=bool(exploded),
                media_types=_media_types(document, item[method]["responses"]),
                formats=_formats(path, parameters),
                responses=frozenset(item[method]["responses"]),
                scope=scope_of(item[method].get("security", document.get("security", []))),
            )


def _media_types(document: Mapping[str, Any], responses: Mapping[str, Any]) -> tuple[str, ...]:
    well = (resolve(document, node) for code, node in responses.items() if code.startswith("2"))
    return tuple(name for node in well for name in node.get("content", ()))


def _formats(path: str, parameters: Sequence[Mapping[str, Any]]) -> Mapping[str, str]:
    """Return the media types by format.

    Raises ValueError if `enum` and `x-media-types` list different formats.
    """
    for parameter in (p for p in parameters if (p["in"], p["name"]) == ("path", "format")):
        listed, media_types = parameter["schema"]["enum"], parameter["x-media-types"]
        if listed != [*media_types]:
            raise ValueError(f"{path}: formats {listed}, x-media-types of {[*media_types]}")
        return dict(media_types)
    return {}


def scope_of(security: Sequence[Mapping[str, Sequence[str]]]) -> str | None:
    """Return the scope of a security requirement, None without one.

    Raises ValueError for more than one scope.
    """
    scopes = [scope for alternative in security for of in alternative.values() for scope in of]
    if len(scopes) > 1:
        raise ValueError(f"scopes {scopes}, expected one at most")
    return scopes[0] if scopes else None


def resolve(document: Mapping[str, Any], node: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return a node with its local $ref resolved."""
    target_node: Any = node
    while "$ref" in target_node:
        target, target_node = target_node["$ref"], document
        for key in target.removeprefix("#/").split("/"):
            target_node = target_node[key]
    return target_node  # type: ignore[no-any-return]


def script_schema() -> dict[str, Any]:
    """Return the JSON Schema of scripts of performances, for files that contain one."""
    return {"$schema": DIALECT, "title": "Script of a performance", **schema("PerformanceQuestion")}


@cache
def schema(name: str) -> dict[str, Any]:
    """Return the JSON Schema of an object of the contract, with its parts in place of references.

    Raises KeyError for a name that the contract does not have.
    """
    document = load_contract().document
    return _standalone(document, document["components"]["schemas"][name])


def _standalone(document: Mapping[str, Any], node: Mapping[str, Any]) -> dict[str, Any]:
    """Return a node without references, and without keywords that only OpenAPI has."""
    schema: dict[str, Any] = {}
    for key, value in resolve(document, node).items():
        if key == "example":
            schema["examples"] = [value]
        elif key == "properties":
            schema[key] = {name: _standalone(document, child) for name, child in value.items()}
        elif key in LISTS:
            schema[key] = [_standalone(document, child) for child in value]
        elif key in PARTS and isinstance(value, Mapping):
            schema[key] = _standalone(document, value)
        elif key != "discriminator":
            schema[key] = value
    return schema
