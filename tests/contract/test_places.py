"""Tests of places by cost: answers of milliseconds do not wait for those of seconds."""

import asyncio
import time

import httpx
import pytest

from posefield.http.api.settings import Settings
from posefield.http.app import create_app
from posefield.registry.model_registry import ModelRegistry

WALK = {"segments": [{"kind": "walk", "model": "cmu_walk", "seconds": 10}]}


async def timed(client, method, url, **content):
    begun = time.perf_counter()
    answer = await client.request(method, url, **content)
    assert answer.status_code == 200, answer.text
    return time.perf_counter() - begun


@pytest.mark.system
def test_a_pose_does_not_wait_for_performances(shipped_walk):
    app = create_app(ModelRegistry({"cmu_walk": shipped_walk}), Settings())
    pose = "GET", "/v1/models/cmu_walk/pose?speed=1.2&time=0.1"

    async def asked():
        transport = httpx.ASGITransport(app)
        async with httpx.AsyncClient(transport=transport, base_url="http://localhost") as client:
            await timed(client, *pose)
            others = [
                asyncio.create_task(timed(client, "POST", "/v1/performances.npz", json=WALK))
                for _ in range(8)
            ]
            await asyncio.sleep(0.05)
            seconds = await timed(client, *pose)
            assert not all(own.done() for own in others)
            return seconds, max(await asyncio.gather(*others))

    seconds, longest = asyncio.run(asked())
    assert seconds < longest / 5
