"""Shared state and types of the operations' handlers."""

from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from hashlib import blake2b
from typing import Generic

from starlette.requests import Request
from starlette.responses import Response

from service.encode.media import F
from service.synthesis.library import Library
from service.synthesis.synthesizer import Synthesizer
from service.web import caching, threads
from service.web.access.policy import Policy
from service.web.batching import Batcher
from service.web.body import BodyMemory
from service.web.readiness import Readiness
from service.web.settings import Settings
from service.web.telling import SILENT, Telling
from service.web.writing import Desk


@dataclass(frozen=True)
class Page:
    """A static document, created at the first request.

    make: returns the content. headers_of: returns the response headers for a content.
    """

    media_type: str
    make: Callable[[], bytes]
    headers_of: Callable[[bytes], Mapping[str, str]] = lambda _: {}

    @cached_property
    def content(self) -> bytes:
        """Content of the document."""
        return self.make()

    @cached_property
    def headers(self) -> Mapping[str, str]:
        """Response headers of the document."""
        return self.headers_of(self.content)

    @cached_property
    def digest(self) -> bytes:
        """Hash of the content, for its entity tag."""
        return blake2b(self.content, digest_size=16).digest()


@dataclass(frozen=True)
class Service:
    """Shared state of all operations.

    contract: version of the contract. pages: by operationId. rules: access policy. origins: for
    CORS. telling: log and traces. code: digest for entity tags. batcher: of pose requests. desk: of
    file requests.
    """

    readiness: Readiness
    settings: Settings
    contract: str
    pages: Mapping[str, Page]
    rules: Policy
    origins: frozenset[bytes] = frozenset()
    telling: Telling = SILENT
    code: bytes = field(default_factory=caching.code)
    batcher: Batcher = field(default_factory=Batcher)
    desk: Desk = field(default_factory=Desk)

    @cached_property
    def bodies(self) -> BodyMemory:
        """Memory limit on the bodies of open requests."""
        return BodyMemory(self.settings.bodies_memory)

    def lifetime(self, model: str) -> bytes:
        """Return the Cache-Control of a response.

        model: key in the path, a name with or without a hash.
        """
        return caching.lifetime(model, self.settings.alias_seconds, self.rules.closed)

    @property
    def library(self) -> Library:
        """Current models; a reload can replace them, so read this once per request."""
        return self.readiness.models.library


Handler = Callable[[Service, Request], Awaitable[Response]]


@dataclass(frozen=True)
class Formatted(Generic[F]):
    """Handler of an operation with several response formats.

    formats: by name, the default first. handler: called with the format that the path or Accept
    has selected (`request.scope["format"]`).
    """

    formats: Mapping[str, F]
    handler: Callable[[F, Service, Request], Awaitable[Response]]

    def __call__(self, service: Service, request: Request) -> Awaitable[Response]:
        return self.handler(self.formats[request.scope["format"]], service, request)


def model(request: Request) -> Synthesizer:
    """Return the model of a request, which the exchange has put into its scope."""
    found: Synthesizer = request.scope["model"]
    return found


async def made(quick: bool, make: Callable[[], bytes]) -> bytes:
    """Return the result of `make`, called here if it is quick, else in a thread."""
    return make() if quick else await threads.run(make)
