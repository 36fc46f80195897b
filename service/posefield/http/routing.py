"""Routing: a tree of path segments, with one look-up per segment.

A path that ends in `{format}` has one entry per format, so that its look-up is as fast.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from posefield.http import negotiation
from posefield.http.api.contract import Operation
from posefield.http.negotiation import Offers
from posefield.http.steps import Handler


@dataclass(frozen=True)
class Route:
    """An operation at one path, and its handler.

    format: format at the end of the path, None for a path without. offers: formats for the
    negotiation by Accept; empty without negotiation.
    """

    operation: Operation
    handler: Handler
    format: str | None = None
    offers: Offers = ()

    @cached_property
    def path(self) -> str:
        """Path template of the contract, with the format filled in."""
        return self.operation.path.replace("{format}", self.format or "")

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
        named = ("Accept", bool(self.offers)), ("Accept-Encoding", self.compresses)
        return ", ".join(name for name, heeded in named if heeded).encode()


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

    fixed: children by segment. any: child of a path parameter, and `name` the parameter's name.
    place: routes of the path that ends here.
    """

    fixed: dict[str, "_TreeNode"] = field(default_factory=dict)
    any: "_TreeNode | None" = None
    name: str = ""
    place: PathRoutes | None = None


class RouteTree:
    """Routing table: places by path."""

    def __init__(self, routes: Iterable[Route]) -> None:
        self._root = _TreeNode()
        self.places: list[PathRoutes] = []
        by_path: dict[str, dict[str, Route]] = {}
        self._formats: dict[str, dict[str, None]] = {}
        for route in routes:
            by_path.setdefault(route.path, {})[route.operation.method] = route
            if route.format:
                stem = route.path.removesuffix(f".{route.format}")
                self._formats.setdefault(stem, {})[route.format] = None
        for path, own in by_path.items():
            self._add(_path_routes(path, own))

    def _add(self, place: PathRoutes) -> None:
        branch = self._root
        for part in place.template.split("/"):
            branch = _child_node(branch, part)
        branch.place = place
        self.places.append(place)

    def find(self, path: str) -> tuple[PathRoutes, dict[str, str]] | None:
        """Return the place of a path and its non-empty path parameters; None if unknown."""
        branch, values = self._root, {}
        for part in path.split("/"):
            known = branch.fixed.get(part)
            if known is None and part and branch.any is not None:
                values[branch.name] = part
                known = branch.any
            if known is None:
                return None
            branch = known
        return (branch.place, values) if branch.place else None

    def other_formats(self, path: str) -> tuple[str, Iterable[str]] | None:
        """Return the unknown format that a path ends in and the known formats of that path."""
        asked = path.rpartition("/")[2].partition(".")[2]
        found = self.find(path.removesuffix(f".{asked}"))
        known = self._formats.get(found[0].template) if found else None
        return (asked, known) if asked and known else None


def _child_node(branch: _TreeNode, part: str) -> _TreeNode:
    if not part.startswith("{"):
        return branch.fixed.setdefault(part, _TreeNode())
    if branch.any is None:
        branch.any, branch.name = _TreeNode(), part.strip("{}")
    if branch.name != part.strip("{}"):
        raise ValueError(f"{part} and {{{branch.name}}} at one place of the contract's paths")
    return branch.any


def _path_routes(path: str, routes: dict[str, Route]) -> PathRoutes:
    own: dict[str, Any] = dict(routes)
    if "GET" in own:
        own["HEAD"] = own["GET"]
    return PathRoutes(path, own, ", ".join(sorted({*own, "OPTIONS"})))
