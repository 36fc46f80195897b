"""Routing: a tree of path segments, with one look-up per segment.

A path that ends in `{format}` has one entry per format, so that its look-up is as fast.
"""

from collections.abc import Awaitable, Callable, Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from starlette.responses import Response

from posefield.http import negotiation
from posefield.http.api.contract import Operation
from posefield.http.negotiation import Offers

Handler = Callable[[Any], Awaitable[Response]]
"""Function of an operation, which answers a `request.ServiceRequest`."""


@dataclass(frozen=True)
class Route:
    """An operation at one path, and its handler.

    format: format at the end of the path, empty for a path without. offers: formats for the
    negotiation by Accept; empty without negotiation.
    """

    operation: Operation
    handler: Handler
    format: str = ""
    offers: Offers = ()

    @cached_property
    def path(self) -> str:
        """Path template of the contract, with the format filled in."""
        return self.operation.path.replace("{format}", self.format)

    @cached_property
    def name(self) -> bytes:
        """The operationId, a part of entity tags."""
        return self.operation.id.encode()

    @cached_property
    def compresses(self) -> bool:
        """True if a response may have a content coding."""
        operation = self.operation
        types = [operation.formats[self.format]] if self.format else operation.media_types
        return any(map(negotiation.is_compressible, types))

    @cached_property
    def vary(self) -> bytes:
        """Value of the Vary header: request headers that the response depends on."""
        headers = ("Accept", bool(self.offers)), ("Accept-Encoding", self.compresses)
        return ", ".join(name for name, matters in headers if matters).encode()


@dataclass(frozen=True)
class PathRoutes:
    """Routes of one path.

    template: path template. routes: by method, with HEAD. allow: value of the header Allow.
    """

    template: str
    routes: Mapping[str, Route]
    allow: str


@dataclass
class _TreeNode:
    """Node of the tree.

    fixed: children by segment. parameter: child of a path parameter, and `name` the parameter's
    name. routes: of the path that ends here.
    """

    fixed: dict[str, "_TreeNode"] = field(default_factory=dict)
    parameter: "_TreeNode | None" = None
    name: str = ""
    routes: PathRoutes | None = None


class RouteTree:
    """Routing table. paths: routes of each path."""

    def __init__(self, routes: Iterable[Route]) -> None:
        self._root = _TreeNode()
        by_path: dict[str, dict[str, Route]] = {}
        self._formats: dict[str, dict[str, None]] = {}
        for route in routes:
            by_path.setdefault(route.path, {})[route.operation.method] = route
            if route.format:
                stem = route.path.removesuffix(f".{route.format}")
                self._formats.setdefault(stem, {})[route.format] = None
        self.paths = [_path_routes(*item) for item in by_path.items()]
        for path in self.paths:
            node = self._root
            for segment in path.template.split("/"):
                node = _child_node(node, segment)
            node.routes = path

    def find(self, path: str) -> tuple[PathRoutes, dict[str, str]] | None:
        """Return the routes of a path and its non-empty path parameters; None if unknown."""
        node, values = self._root, {}
        for segment in path.split("/"):
            child = node.fixed.get(segment)
            if child is None and segment and node.parameter is not None:
                values[node.name] = segment
                child = node.parameter
            if child is None:
                return None
            node = child
        return (node.routes, values) if node.routes else None

    def other_formats(self, path: str) -> tuple[str, Iterable[str]] | None:
        """Return the unknown format that a path ends in and the known formats of that path."""
        unknown = path.rpartition("/")[2].partition(".")[2]
        stem = self.find(path.removesuffix(f".{unknown}"))
        formats = self._formats.get(stem[0].template) if stem else None
        return (unknown, formats) if unknown and formats else None


def _child_node(node: _TreeNode, segment: str) -> _TreeNode:
    if not segment.startswith("{"):
        return node.fixed.setdefault(segment, _TreeNode())
    if node.parameter is None:
        node.parameter, node.name = _TreeNode(), segment.strip("{}")
    if node.name != segment.strip("{}"):
        raise ValueError(f"{segment} and {{{node.name}}} at one place of the contract's paths")
    return node.parameter


def _path_routes(path: str, routes: dict[str, Route]) -> PathRoutes:
    methods = {**routes, "HEAD": routes["GET"]} if "GET" in routes else routes
    return PathRoutes(path, methods, ", ".join(sorted({*methods, "OPTIONS"})))
