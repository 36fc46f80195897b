"""How long and how much a client may take, and one look at all connections for who takes longer."""

import asyncio
from collections.abc import Collection
from dataclasses import dataclass
from typing import Protocol

from service.web.settings import Settings

PERIOD = 0.5
"""Seconds between two looks: a timer of its own for each request would cost it a microsecond."""

FIELDS = 100
"""Header lines of a request: browsers send 20."""


@dataclass(frozen=True)
class Limits:
    """What a client may take: bytes of a URL and of header lines, seconds, connections."""

    url: int
    head: int
    head_time: int
    body_time: int
    idle_time: int
    drain_time: int
    connections: int


def of(settings: Settings) -> Limits:
    """Limits of the settings."""
    return Limits(
        url=settings.url_limit,
        head=settings.head_limit,
        head_time=settings.head_time,
        body_time=settings.body_time,
        idle_time=settings.idle_time,
        drain_time=settings.drain_time,
        connections=settings.connections,
    )


class Connection(Protocol):
    """What is looked at: service.web.protocol.Bounded."""

    def look(self, now: float) -> None:
        """End what took too long."""


class Watch:
    """Looks at connections for as long as there are any."""

    def __init__(self) -> None:
        self._planned = False

    def start(self, loop: asyncio.AbstractEventLoop, all_: Collection[Connection]) -> None:
        """Look at these connections, from now on if not already."""
        if not self._planned:
            self._planned = True
            loop.call_later(PERIOD, self._look, loop, all_)

    def _look(self, loop: asyncio.AbstractEventLoop, all_: Collection[Connection]) -> None:
        now = loop.time()
        for connection in tuple(all_):
            connection.look(now)
        self._planned = False
        if all_:
            self.start(loop, all_)
