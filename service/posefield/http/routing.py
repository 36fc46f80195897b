"""Routes: the contract's operations at their paths, each with its handler."""

from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass
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
