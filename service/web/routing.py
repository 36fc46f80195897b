"""Which operations lie at a path: one look-up for each part of it, however many there are."""

from collections.abc import Awaitable, Callable, Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from starlette.requests import Request
from starlette.responses import Response

from service.web import compression
from service.web.contract import Operation
from service.web.negotiation import Offers

Endpoint = Callable[[Request], Awaitable[Response]]


@dataclass(frozen=True)
class Route:
    """An operation and what answers it; offers: what Accept chooses among, if it does."""

    operation: Operation
    endpoint: Endpoint
    offers: Offers = ()

    @cached_property
    def name(self) -> bytes:
        """Of the operation, as part of what an entity tag is made of."""
        return self.operation.id.encode()

    @cached_property
    def compresses(self) -> bool:
        """Whether an answer may be sent in a content coding."""
        return any(map(compression.pays, self.operation.media_types))

    @cached_property
    def vary(self) -> bytes:
        """Which of the request's headers the answer depends on."""
        named = ("Accept", bool(self.offers)), ("Accept-Encoding", self.compresses)
        return ", ".join(name for name, heeded in named if heeded).encode()


@dataclass(frozen=True)
class Place:
    """What lies at a path: its routes by method, HEAD among them, and all its methods as the header
    Allow lists them."""

    template: str
    routes: Mapping[str, Route]
    allow: str


@dataclass
class _Branch:
    """The parts of paths that may follow; `any` is what takes every part, under a name."""

    fixed: dict[str, "_Branch"] = field(default_factory=dict)
    any: "_Branch | None" = None
    name: str = ""
    place: Place | None = None


class Map:
    """Places by path."""

    def __init__(self, routes: Iterable[Route]) -> None:
        self._root = _Branch()
        self.places: list[Place] = []
        by_path: dict[str, dict[str, Route]] = {}
        for route in routes:
            by_path.setdefault(route.operation.path, {})[route.operation.method] = route
        for path, own in by_path.items():
            self._add(_place(path, own))

    def _add(self, place: Place) -> None:
        branch = self._root
        for part in place.template.split("/"):
            branch = _grown(branch, part)
        branch.place = place
        self.places.append(place)

    def find(self, path: str) -> tuple[Place, dict[str, str]] | None:
        """What lies at a path, and the values of the parameters in it; none of them is empty."""
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


def _grown(branch: _Branch, part: str) -> _Branch:
    if not part.startswith("{"):
        return branch.fixed.setdefault(part, _Branch())
    if branch.any is None:
        branch.any, branch.name = _Branch(), part.strip("{}")
    if branch.name != part.strip("{}"):
        raise ValueError(f"{part} and {{{branch.name}}} at one place of the contract's paths")
    return branch.any


def _place(path: str, routes: dict[str, Route]) -> Place:
    own: dict[str, Any] = dict(routes)
    if "GET" in own:
        own["HEAD"] = own["GET"]
    return Place(path, own, ", ".join(sorted({*own, "OPTIONS"})))
