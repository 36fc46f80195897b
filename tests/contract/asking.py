"""Requests to an app in this process."""

import asyncio
from collections.abc import Callable
from typing import Any

import httpx
from starlette.applications import Starlette

Ask = Callable[..., httpx.Response]


def asker(app: Starlette) -> Ask:
    async def send(method: str, url: str, **content: Any) -> httpx.Response:
        transport = httpx.ASGITransport(app)
        async with httpx.AsyncClient(transport=transport, base_url="http://test") as client:
            return await client.request(method, url, **content)

    return lambda *args, **kwargs: asyncio.run(send(*args, **kwargs))
