"""What handlers of operations share."""

import os
from collections.abc import Awaitable, Callable
from dataclasses import dataclass

from anyio import CapacityLimiter
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import Response

from service.synthesis.library import Library
from service.synthesis.synthesizer import Synthesizer
from service.web.settings import Settings

# Crowds take as long as many clips: of their own, these threads hold nobody else up.
CROWDS = CapacityLimiter(os.cpu_count() or 1)
CLIPS = CapacityLimiter(os.cpu_count() or 1)


@dataclass(frozen=True)
class Service:
    """What every operation may use."""

    library: Library
    settings: Settings
    source: bytes


Handler = Callable[[Service, Request], Awaitable[Response]]


def model(service: Service, request: Request) -> Synthesizer:
    """The model that a path names."""
    return service.library.find(request.path_params["model"])


async def made(quick: bool, make: Callable[[], bytes]) -> bytes:
    """What `make` returns: at once if that is quick, else in a thread."""
    return make() if quick else await run_in_threadpool(make)
