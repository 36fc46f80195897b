"""Requests to an app in this process."""

import asyncio
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import httpx
import uvicorn
from starlette.applications import Starlette

Ask = Callable[..., httpx.Response]


def asker(app: Starlette) -> Ask:
    async def send(method: str, url: str, **content: Any) -> httpx.Response:
        transport = httpx.ASGITransport(app)
        async with httpx.AsyncClient(transport=transport, base_url="http://test") as client:
            return await client.request(method, url, **content)

    return lambda *args, **kwargs: asyncio.run(send(*args, **kwargs))


@contextmanager
def listening(app: Starlette) -> Iterator[str]:
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
