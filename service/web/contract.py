"""The contract: api/openapi.yaml as the service reads it."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import yaml

MEDIA_TYPE = "application/yaml"
METHODS = ("get", "put", "post", "delete", "options", "head", "patch", "trace")


@dataclass(frozen=True)
class Operation:
    """One operation of the contract.

    query: names of its query parameters. open_query: whether the query may hold other names too,
    because an exploded object (the controls of a model) stands among the parameters. media_types:
    of what it answers with when all is well. responses: statuses.
    scope: what a key must allow, where the service asks for keys; None where it never does.
    """

    id: str
    method: str
    path: str
    query: frozenset[str]
    open_query: bool
    media_types: tuple[str, ...] = ()
    responses: frozenset[str] = frozenset()
    scope: str | None = None

    @cached_property
    def sheds(self) -> bool:
        """Whether it is refused when there is too much to do; what watches the service is not."""
        return self.scope == "read"

    @cached_property
    def pure(self) -> bool:
        """Whether its answer follows from the model and the request's line alone."""
        return "304" in self.responses


@dataclass(frozen=True)
class Contract:
    """The contract's bytes, to be served as they are, what they say, and its operations."""

    source: bytes
    document: Mapping[str, Any]
    operations: tuple[Operation, ...]

    @property
    def version(self) -> str:
        """Of the contract, not of the service."""
        return str(self.document["info"]["version"])


def load() -> Contract:
    """Contract that lies beside this module."""
    source = Path(__file__).with_name("openapi.yaml").read_bytes()
    return parse(source)


def parse(source: bytes) -> Contract:
    """Contract of a document's bytes."""
    document = yaml.load(source, yaml.CSafeLoader)
    return Contract(source, document, tuple(_operations(document)))


def _operations(document: Mapping[str, Any]) -> Iterator[Operation]:
    for path, item in document["paths"].items():
        for method in (m for m in METHODS if m in item):
            given = [*item.get("parameters", []), *item[method].get("parameters", [])]
            query = [p for p in (resolve(document, g) for g in given) if p["in"] == "query"]
            exploded = [p["name"] for p in query if p["schema"].get("type") == "object"]
            yield Operation(
                id=item[method]["operationId"],
                method=method.upper(),
                path=path,
                query=frozenset(p["name"] for p in query) - set(exploded),
                open_query=bool(exploded),
                media_types=_media_types(document, item[method]["responses"]),
                responses=frozenset(item[method]["responses"]),
                scope=scope_of(item[method].get("security", document.get("security", []))),
            )


def _media_types(document: Mapping[str, Any], responses: Mapping[str, Any]) -> tuple[str, ...]:
    well = (resolve(document, node) for code, node in responses.items() if code.startswith("2"))
    return tuple(name for node in well for name in node.get("content", ()))


def scope_of(security: Sequence[Mapping[str, Sequence[str]]]) -> str | None:
    """The one scope of a security requirement; its other alternative is a service without keys."""
    scopes = [scope for alternative in security for of in alternative.values() for scope in of]
    if len(scopes) > 1:
        raise ValueError(f"scopes {scopes}, expected one at most")
    return scopes[0] if scopes else None


def resolve(document: Mapping[str, Any], node: Mapping[str, Any]) -> Mapping[str, Any]:
    """The node itself, or what its local $ref points to."""
    found: Any = node
    while "$ref" in found:
        target, found = found["$ref"], document
        for part in target.removeprefix("#/").split("/"):
            found = found[part]
    return found  # type: ignore[no-any-return]
