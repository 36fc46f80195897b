"""A server that ends without losing a request: who was let in is answered, and told to go.

uvicorn resets connections that it has not accepted yet, and closes those between two requests
though the next may be on its way.
"""

import asyncio
import fcntl
import logging
import signal
import socket
import struct
import termios
from collections.abc import Callable
from dataclasses import dataclass
from types import FrameType
from typing import Any

import uvicorn

from service.web import listening
from service.web.readiness import Readiness

log = logging.getLogger(__name__)

LINGER = 0.5
"""Seconds in which connections that have begun are accepted, and idle ones may yet ask."""
TICK = 0.02
CLOSE = (b"connection", b"close")


@dataclass(frozen=True)
class Ending:
    """Seconds that the service still listens once told to end, and that requests then get."""

    drain: float
    grace: float


class Server(uvicorn.Server):
    """Says when it listens, and ends in order on SIGTERM or SIGINT, at once on a second one.

    cut_off: how many connections were not done in time.
    """

    def __init__(
        self,
        config: uvicorn.Config,
        readiness: Readiness,
        ending: Ending,
        listens: Callable[[], None],
        owner: socket.socket | None,
    ) -> None:
        """listens: called once it does. owner: a socket whose end is a demand to end, too."""
        super().__init__(config)
        self._readiness = readiness
        self._ending = ending
        self._listens = listens
        self._owner = owner
        self._hurried = False
        self.cut_off = 0

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Listen, then say so."""
        await super().startup(sockets)
        if self._owner:
            asyncio.get_running_loop().add_reader(self._owner, self._orphaned, self._owner)
        self._listens()

    def _orphaned(self, owner: socket.socket) -> None:
        asyncio.get_running_loop().remove_reader(owner)
        self.handle_exit()

    def handle_exit(self, sig: int = signal.SIGTERM, frame: FrameType | None = None) -> None:
        """Begin to end: from here on nothing is ready, and every answer closes its connection."""
        self._hurried = self.should_exit
        self.should_exit = self._readiness.draining = True
        # uvicorn puts these on each answer and heeds them; it makes the first of the second anew.
        self.server_state.default_headers = [*self.server_state.default_headers, CLOSE]
        self.config.encoded_headers = [CLOSE]

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Tell clients to go, stop listening, answer who was let in."""
        for connection in self._connections():
            cycle = connection.cycle
            # Where the head of an answer has gone, nobody would be told.
            if cycle is not None and not cycle.response_started:
                cycle.keep_alive = False
        await self._until(self._ending.drain, lambda: False)
        listening.turn_away(sockets or [])
        await self._until(LINGER, lambda: False)
        for server in self.servers:
            server.close()
        listening.close(sockets or [])
        await self._until(self._ending.grace, self._done)
        self._cut_off()

    async def _until(self, seconds: float, done: Callable[[], bool]) -> None:
        """Wait until that, so many seconds at most, and not when told twice to end."""
        loop, count = asyncio.get_running_loop(), 0
        end = loop.time() + seconds
        while not (done() or self._hurried or loop.time() >= end):
            # It keeps the Date of answers right, every tenth time.
            await self.on_tick(count)
            await asyncio.sleep(TICK)
            count += 1

    def _done(self) -> bool:
        # Whoever was answered without being told to go may be asking at this moment.
        before = asyncio.get_running_loop().time() - LINGER
        for connection in self._connections():
            if connection.since < before and _is_idle(connection):
                connection.transport.close()
        return not self.server_state.connections and not self.server_state.tasks

    def _cut_off(self) -> None:
        """Break off whatever is left."""
        self.cut_off = len(self.server_state.connections)
        if not self.cut_off and not self.server_state.tasks:
            return
        log.error("%d connections were cut off: their time was over", self.cut_off)
        # It would tell of each task where it was.
        logging.getLogger("uvicorn.error").setLevel(logging.CRITICAL)
        for connection in self._connections():
            connection.transport.abort()
        for task in self.server_state.tasks:
            task.cancel()

    def _connections(self) -> list[Any]:
        return list(self.server_state.connections)


def _is_idle(connection: Any) -> bool:
    """Whether nothing of a request has come, and nothing of an answer is to go."""
    cycle = connection.cycle
    if cycle is not None and not cycle.response_complete:
        return False
    # The head of a request makes a scope when it begins, and a cycle of it when it is whole.
    if connection.scope is not None and (cycle is None or cycle.scope is not connection.scope):
        return False
    return not _waiting(connection.transport.get_extra_info("socket"))


def _waiting(wire: socket.socket) -> int:
    """Bytes that have come and not been read."""
    found = fcntl.ioctl(wire.fileno(), termios.FIONREAD, b"\0" * 4)
    return int(struct.unpack("i", found)[0])
