"""Write coalescing: one system call per connection and iteration of the event loop.

uvicorn writes the head and the body of a response separately, and uvloop makes a system call for
each. On Linux the second one takes a fifth of the CPU time of a pose request over 32 connections:
see docs/decisions/0001-http-server.md.
"""

import asyncio
from collections.abc import Iterable
from typing import Any

from uvicorn.protocols.http.auto import AutoHTTPProtocol

MAX_BUFFER = 64 * 1024
"""Maximum bytes of the buffer: flow control must see larger amounts."""


class CoalescingProtocol(AutoHTTPProtocol):  # type: ignore[misc, valid-type]
    """uvicorn's HTTP/1.1 protocol with write coalescing."""

    def connection_made(self, transport: Any) -> None:
        """Wrap the transport of a new connection."""
        super().connection_made(CoalescingTransport(transport))

    def on_headers_complete(self) -> None:
        """Start the request, and collect trailers apart from its headers.

        uvicorn would append trailers to the request's headers, after a proxy has checked those.
        """
        super().on_headers_complete()
        self.headers: list[tuple[bytes, bytes]] = []


class CoalescingTransport:
    """A transport that buffers writes until the next iteration of the event loop."""

    def __init__(self, transport: asyncio.Transport) -> None:
        self._transport = transport
        self._call_soon = asyncio.get_running_loop().call_soon
        self._buffer: list[bytes] = []
        self._size = 0

    def __getattr__(self, name: str) -> Any:
        return getattr(self._transport, name)

    def write(self, data: bytes) -> None:
        """Buffer data; it is sent in the next iteration or when the buffer exceeds its maximum."""
        if not self._buffer:
            self._call_soon(self._flush)
        self._buffer.append(data)
        self._size += len(data)
        if self._size > MAX_BUFFER:
            self._flush()

    def writelines(self, pieces: Iterable[bytes]) -> None:
        """Buffer pieces of data as by `write`."""
        for piece in pieces:
            self.write(piece)

    def close(self) -> None:
        """Send the buffer, then close the transport."""
        self._flush()
        self._transport.close()

    def _flush(self) -> None:
        held, self._buffer, self._size = self._buffer, [], 0
        # A client that has reset its connection closes the transport before the next iteration;
        # uvloop raises an error for a write to a closed one.
        if held and not self._transport.is_closing():
            self._transport.writelines(held)
