"""A server that answers the same bytes whatever it is asked: how cheap a service can be.

.venv/bin/python benchmarks/client_same.py FILE MEDIA_TYPE PORT
"""

import asyncio
import sys
from pathlib import Path

END = b"\r\n\r\n"


class Same(asyncio.Protocol):
    """One connection: an answer for each head of a request."""

    said = b""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Remember whom to answer."""
        assert isinstance(transport, asyncio.Transport)
        self.transport, self.held = transport, b""

    def data_received(self, data: bytes) -> None:
        """Answer as many requests as have come."""
        heads = (self.held + data).split(END)
        self.held = heads.pop()
        self.transport.write(self.said * len(heads))


async def main(content: bytes, media_type: str, port: int) -> None:
    """Answer until ended."""
    head = f"HTTP/1.1 200 OK\r\nContent-Type: {media_type}\r\nContent-Length: {len(content)}"
    Same.said = head.encode() + END + content
    server = await asyncio.get_running_loop().create_server(Same, "127.0.0.1", port)
    await server.serve_forever()


if __name__ == "__main__":
    asyncio.run(main(Path(sys.argv[1]).read_bytes(), sys.argv[2], int(sys.argv[3])))
