"""Requests to an app in this process, and archives that it answers with."""

import asyncio
import io
import tarfile
import threading
import time
import zipfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import httpx
import uvicorn
from starlette.types import ASGIApp

Ask = Callable[..., httpx.Response]


def asker(app: ASGIApp) -> Ask:
    async def send(method: str, url: str, **content: Any) -> httpx.Response:
        transport = httpx.ASGITransport(app)
        async with httpx.AsyncClient(transport=transport, base_url="http://test") as client:
            return await client.request(method, url, **content)

    return lambda *args, **kwargs: asyncio.run(send(*args, **kwargs))


@contextmanager
def listening(app: ASGIApp) -> Iterator[str]:
    """Address of the app, which listens on a socket in a thread of this process."""
    config = uvicorn.Config(app, port=0, lifespan="off", log_config=None)
    server = uvicorn.Server(config)
    thread = threading.Thread(target=server.run)
    thread.start()
    try:
        while not server.started:
            time.sleep(0.01)
        yield f"http://127.0.0.1:{server.servers[0].sockets[0].getsockname()[1]}"
    finally:
        server.should_exit = True
        thread.join()


def unpacked(kind: str, content: bytes) -> dict[str, bytes]:
    """Names and contents in their order."""
    if kind == "tar":
        with tarfile.open(fileobj=io.BytesIO(content), mode="r:") as found:
            return {m.name: found.extractfile(m).read() for m in found.getmembers()}
    with zipfile.ZipFile(io.BytesIO(content)) as found:
        return {name: found.read(name) for name in found.namelist()}
