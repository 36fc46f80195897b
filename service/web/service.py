"""What handlers of operations share."""

import os
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from hashlib import blake2b

from anyio import CapacityLimiter
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import Response

from service.synthesis.library import Library
from service.synthesis.synthesizer import Synthesizer
from service.web import caching
from service.web.access.policy import Policy
from service.web.batching import Batcher
from service.web.readiness import Readiness
from service.web.settings import Settings
from service.web.telling import SILENT, Telling
from service.web.writing import Desk

# Crowds take as long as many clips: of their own, these threads hold nobody else up.
CROWDS = CapacityLimiter(os.cpu_count() or 1)
CLIPS = CapacityLimiter(os.cpu_count() or 1)


@dataclass(frozen=True)
class Page:
    """A document, and headers that it is sent with."""

    content: bytes
    media_type: str
    headers: Mapping[str, str] = field(default_factory=dict)

    @cached_property
    def digest(self) -> bytes:
        """What its entity tag is made of."""
        return blake2b(self.content, digest_size=16).digest()


@dataclass(frozen=True)
class Service:
    """What every operation may use; contract: its version. pages: by
    operationId."""

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

    def lifetime(self, model: str) -> bytes:
        """How long an answer may be used unasked, by the model's name in its path."""
        return caching.lifetime(model, self.settings.alias_seconds, self.rules.closed)

    @property
    def library(self) -> Library:
        """The models as they are now: to be taken once a request."""
        return self.readiness.models.library


Handler = Callable[[Service, Request], Awaitable[Response]]


def model(request: Request) -> Synthesizer:
    """The model that a path names, which was found before the operation began."""
    found: Synthesizer = request.scope["model"]
    return found


async def made(quick: bool, make: Callable[[], bytes]) -> bytes:
    """What `make` returns: at once if that is quick, else in a thread."""
    return make() if quick else await run_in_threadpool(make)
