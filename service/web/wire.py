"""A connection that ends so that the client hears the last answer, and no later than it may."""

import asyncio
import math
import socket
from collections.abc import Callable
from typing import Any

SLOWEST = 4096
"""Bytes a second below which a client is a fault and not slow: good modems were faster."""

LINGER = 2.0
"""Seconds in which what a refused client still sends is read and thrown away: were the socket
closed at once, that would reset the connection and lose the answer (RFC 9112, 9.6)."""

UNHEARD = 8 * 1024 * 1024
"""Bytes that it may send meanwhile."""

UNSENT = 128 * 1024
"""Bytes that may wait in the system to be sent."""


class Wire:
    """A transport whose `close` may linger; all else is the transport's own.

    sending: says whether the client may still be sending. drain_time: seconds in which it has to
    take what was sent, or at least SLOWEST a second of it. left: whether nothing more is answered.
    """

    def __init__(
        self, transport: asyncio.Transport, sending: Callable[[], bool], drain_time: float
    ) -> None:
        self.transport = transport
        self.sending = sending
        self.drain_time = drain_time
        self.left = False
        self._left_at = self._owed_since = math.inf
        self._owed = self._dropped = 0
        # The system's own buffer would swallow megabytes and hide who takes nothing of them.
        transport.get_extra_info("socket").setsockopt(
            socket.IPPROTO_TCP, socket.TCP_NOTSENT_LOWAT, UNSENT
        )
        self._now = asyncio.get_running_loop().time
        # What every request needs is bound here: a call through this object would take longer.
        self.write = transport.write
        self.abort = transport.abort
        self.pause_reading = transport.pause_reading
        self.resume_reading = transport.resume_reading
        self.get_extra_info: Callable[..., Any] = transport.get_extra_info

    def is_closing(self) -> bool:
        """Whether nothing more is answered here."""
        return self.left or self.transport.is_closing()

    def close(self) -> None:
        """Send what is left, then end; while the client is sending, not before it has heard."""
        if self.left:
            return
        self.left, self._left_at = True, self._now()
        self.owe()
        if self.transport.is_closing() or not self.sending():
            self.transport.close()
            return
        self.transport.write_eof()
        self.transport.resume_reading()

    def drop(self, data: bytes) -> None:
        """Throw away what comes after the last answer, but not without end."""
        self._dropped += len(data)
        if self._dropped > UNHEARD:
            self.transport.abort()

    def owe(self) -> None:
        """From now on the client has to take what was sent."""
        self._owed_since = self._now()
        self._owed = self.transport.get_write_buffer_size()

    def settle(self) -> None:
        """The client has taken enough."""
        if not self.left:
            self._owed_since = math.inf

    def look(self, now: float) -> None:
        """End what a client does not take, and what has lingered."""
        owed = self.transport.get_write_buffer_size()
        if now > self._left_at + LINGER and not owed:
            self.transport.abort()
        elif now > self._owed_since + self.drain_time:
            if self._owed - owed < (now - self._owed_since) * SLOWEST:
                self.transport.abort()
            else:
                self.owe()
