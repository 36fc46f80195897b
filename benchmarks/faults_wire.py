"""HTTP/1.1 on a socket, as little of it as it takes to break every rule of it."""

import asyncio
import socket
from collections.abc import Mapping
from dataclasses import dataclass
from time import monotonic

from faults_known import Answer

PATIENCE = 60.0
"""Seconds after which an answer is taken to be lost."""


@dataclass
class Wire:
    """A connection.

    opened_at: when it was first asked for. is_closing: whether an answer said that it is the last.
    """

    reader: asyncio.StreamReader
    writer: asyncio.StreamWriter
    opened_at: float
    is_closing: bool = False

    async def send(self, content: bytes) -> None:
        """Send it all."""
        self.writer.write(content)
        await self.writer.drain()

    async def answer(self, method: str = "GET") -> Answer:
        """The next answer; OSError, EOFError or TimeoutError where there is none."""
        async with asyncio.timeout(PATIENCE):
            return await self._answer(method)

    async def _answer(self, method: str) -> Answer:
        line = await self._line()
        status = int(line.split()[1])
        headers = {}
        while text := (await self._line()).strip():
            name, _, value = text.decode("latin-1").partition(": ")
            headers[name.lower()] = value
        self.is_closing = headers.get("connection") == "close"
        return Answer(status, headers, await self._body(method, status, headers))

    async def _line(self) -> bytes:
        line = await self.reader.readline()
        if not line.endswith(b"\n"):
            raise EOFError("the connection ended")
        return line

    async def _body(self, method: str, status: int, headers: Mapping[str, str]) -> bytes:
        if method == "HEAD" or status in (204, 304):
            return b""
        if headers.get("transfer-encoding") != "chunked":
            return await self.reader.readexactly(int(headers["content-length"]))
        body = b""
        while size := int(await self._line(), 16):
            body += await self.reader.readexactly(size)
            await self._line()
        await self._line()
        return body

    def hang_up(self) -> None:
        """End the connection at once, whatever is under way."""
        self.writer.transport.abort()


async def opened(port: int, receive: int | None = None) -> Wire:
    """A connection; receive: bytes that wait here at most, for those who take little at a time."""
    start, connection = monotonic(), socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    connection.setblocking(False)
    if receive is not None:
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive)
    try:
        async with asyncio.timeout(PATIENCE):
            await asyncio.get_running_loop().sock_connect(connection, ("127.0.0.1", port))
    except BaseException:
        connection.close()
        raise
    limit = 1 << 16 if receive is None else receive
    return Wire(*await asyncio.open_connection(sock=connection, limit=limit), start)
